// Received samples into a recording.
#pragma once

#include <perimap.h>

#include <filesystem>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/recording_writer.hpp"

namespace perimap {

// Log time is the receipt, publish time the sample's own: release_time_ns of a surface, time_ns of the others.
class SampleRecorder {
 public:
  // `generator` names the program and its version in the recording.
  [[nodiscard]] static Expected<SampleRecorder> create(const std::filesystem::path& file, std::string generator);

  [[nodiscard]] Expected<void> write(const perimap_Surface& surface, Instant receipt);
  [[nodiscard]] Expected<void> write(const perimap_SurfaceModel& model, Instant receipt);
  [[nodiscard]] Expected<void> write(const perimap_Phase& phase, Instant receipt);
  [[nodiscard]] Expected<void> write(const perimap_Status& status, Instant receipt);
  [[nodiscard]] Expected<void> finish() { return writer_.finish(); }

 private:
  SampleRecorder(RecordingWriter writer, std::string generator)
      : writer_(std::move(writer)), generator_(std::move(generator)) {}

  // The facts of the recording, known with the first surface.
  [[nodiscard]] Expected<void> write_info(const perimap_Surface& surface, Instant receipt);

  RecordingWriter writer_;
  std::string generator_;
  bool info_written_ = false;
  ChannelId info_;
  ChannelId surface_;
  ChannelId model_;
  ChannelId phase_;
  ChannelId status_;
};

}  // namespace perimap
