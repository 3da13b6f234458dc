// What tracker and ECG device measure in a session that emulated devices play: a recording, or a simulated heart.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/emulator/ecg_device_signals.hpp"
#include "drivers/standins/emulator/pose_track.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

// Whoever plays the same session from the same instant plays in step: `start` is when its first message arrives.
class PlayedSession {
 public:
  [[nodiscard]] static Expected<PlayedSession> read(const std::string& path);
  [[nodiscard]] static PlayedSession of(const Simulation& simulation, const TrackerNoise& noise);

  [[nodiscard]] PoseTrack poses(Instant start) const;
  // Of the other tools that the recording has, by their channels' names below channels::kTrackedTools: "pointer",
  // "instrument/0D". They are in the frame that poses() is in, and the reference, whose frame that may be, is left out.
  [[nodiscard]] std::vector<std::pair<std::string, PoseTrack>> tools(Instant start) const;
  // With respiration where there is such a channel.
  [[nodiscard]] EcgDeviceSignals ecg_device(Instant start) const;

 private:
  [[nodiscard]] Expected<void> read_tools(const std::string& path);

  Instant first_arrival_{};
  std::vector<TrackerSample> tracker_;
  std::vector<std::pair<std::string, std::vector<TrackerSample>>> tools_;  // those with readings
  std::vector<EcgBlock> ecg_;
  std::vector<RespirationBlock> respiration_;
};

}  // namespace perimap
