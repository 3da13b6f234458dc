// Where the tools are that an emulated tracker sees.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/tracker/tool_reading.hpp"

namespace perimap {

// Readings, each at its own time from an instant on; before the first and after the last the tool is missing.
class PoseTrack {
 public:
  // The tracker samples of a recording at their own times, gaps and jitter included; the first of them at `start`.
  // They are in order of time.
  [[nodiscard]] static PoseTrack of_samples(Instant start, const std::vector<TrackerSample>& samples);
  // A scope held half a metre in front of the tracker that sways by 20 mm and 0.1 rad within four seconds, for an hour.
  [[nodiscard]] static PoseTrack swaying(Instant start, double rate_hz);

  // A pointer whose tip, there in its own frame, rests half a metre in front of the tracker while it is turned about it
  // by half a radian each way, for an hour.
  [[nodiscard]] static PoseTrack pivoting(Instant start, double rate_hz, const Vector3d& tip_O_mm);
  // Held still there, for an hour.
  [[nodiscard]] static PoseTrack still(Instant start, const Pose& X_TO);

  [[nodiscard]] Instant start() const noexcept { return start_; }
  // Of a device that would have given these readings: gaps do not count.
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }

  // For a device that tells each reading when it was measured.
  [[nodiscard]] std::size_t size() const noexcept { return readings_.size(); }
  [[nodiscard]] Duration since_start(std::size_t i) const noexcept { return readings_[i].since; }
  [[nodiscard]] const ToolReading& reading(std::size_t i) const noexcept { return readings_[i].reading; }
  // The last reading that is not after that time; the first when there is none.
  [[nodiscard]] std::size_t index_at(Duration since) const noexcept;

  // For a device that measures at even frames, rate_hz() a second: where the tool is at that frame, between the two
  // readings around it. Next to a gap, where there is but one, that one when it is nearer than half a period.
  [[nodiscard]] ToolReading at(std::int64_t frame) const noexcept;
  // The same so long after the start.
  [[nodiscard]] ToolReading at(Duration since) const noexcept;

 private:
  struct Timed {
    Duration since;
    ToolReading reading;
  };

  [[nodiscard]] ToolReading reading_at(double since_ns) const noexcept;

  PoseTrack(Instant start, double rate_hz, std::vector<Timed> readings);

  Instant start_;
  double rate_hz_;
  std::vector<Timed> readings_;
};

}  // namespace perimap
