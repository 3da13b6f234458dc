// Where the tools are that an emulated tracker sees.
#pragma once

#include <vector>

#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/tracker/tool_reading.hpp"

namespace perimap {

// A reading at every period from an instant on; after the last one the tool is missing.
class PoseTrack {
 public:
  PoseTrack(Instant start, double rate_hz, std::vector<ToolReading> readings)
      : start_(start), rate_hz_(rate_hz), readings_(std::move(readings)) {}

  // The tracker samples of a recording as they lie, an even period apart; the first of them at `start`. None are left
  // out.
  [[nodiscard]] static PoseTrack of_samples(Instant start, const std::vector<TrackerSample>& samples);
  // A scope held half a metre in front of the tracker that sways by 20 mm and 0.1 rad within four seconds, for an hour.
  [[nodiscard]] static PoseTrack swaying(Instant start, double rate_hz);

  [[nodiscard]] Instant start() const noexcept { return start_; }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }
  [[nodiscard]] bool over(std::int64_t frame) const noexcept {
    return frame >= static_cast<std::int64_t>(readings_.size());
  }
  // Missing before the first and after the last.
  [[nodiscard]] ToolReading at(std::int64_t frame) const noexcept {
    return frame < 0 || over(frame) ? ToolReading{} : readings_[static_cast<std::size_t>(frame)];
  }

 private:
  Instant start_;
  double rate_hz_;
  std::vector<ToolReading> readings_;
};

}  // namespace perimap
