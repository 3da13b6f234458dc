// The samples in a black box as a recording, as `perimap watch --record` makes one.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "core/error/expected.hpp"
#include "daemon/black_box/entry.hpp"
#include "daemon/publishing/sample_recorder.hpp"

namespace perimap::black_box {

class SamplesToRecording {
 public:
  [[nodiscard]] static Expected<SamplesToRecording> create(const std::filesystem::path& file, std::string generator);

  // What is no sample is left out. The receipt is when the entry was told.
  void take(const Entry& entry);
  // The first error, if there was one.
  [[nodiscard]] Expected<void> finish();

 private:
  explicit SamplesToRecording(SampleRecorder recorder) : recorder_(std::move(recorder)) {}
  template <class T>
  void write(const Entry& entry);

  SampleRecorder recorder_;
  Expected<void> first_error_;
};

}  // namespace perimap::black_box
