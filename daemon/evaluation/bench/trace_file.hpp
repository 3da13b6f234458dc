// The trace of a benchmark's runs, as a file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/error/expected.hpp"
#include "core/pipeline/frame_trace.hpp"
#include "drivers/file/c_stream.hpp"
#include "drivers/file/whole_file.hpp"

namespace perimap::bench {

// There when finish() has returned, and not before. Errors name the file.
class TraceFile {
 public:
  [[nodiscard]] static Expected<TraceFile> create(const std::string& path);

  // A run that has ended, see trace_events().
  [[nodiscard]] Expected<void> add(const std::string& name, const FrameTrace& trace,
                                   std::optional<Instant> counted_from);
  [[nodiscard]] Expected<void> finish();
  // Of all runs: what found no room in their traces.
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  TraceFile(std::string path, WholeFile whole, CStream file, Instant zero)
      : path_(std::move(path)), whole_(std::move(whole)), file_(std::move(file)), zero_(zero) {}
  [[nodiscard]] Expected<void> write(const std::string& text);

  std::string path_;
  WholeFile whole_;
  CStream file_;
  Instant zero_;
  int runs_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace perimap::bench
