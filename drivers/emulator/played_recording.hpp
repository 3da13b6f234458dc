// The sensors' part of a recording that emulated devices play.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/emulator/ecg_waveform.hpp"
#include "drivers/emulator/pose_track.hpp"

namespace perimap {

// Whoever plays the same recording from the same instant plays in step: `start` is when its first message arrives.
class PlayedRecording {
 public:
  [[nodiscard]] static Expected<PlayedRecording> read(const std::string& path);

  [[nodiscard]] PoseTrack poses(Instant start) const;
  [[nodiscard]] EcgWaveform ecg(Instant start) const;

 private:
  Instant first_arrival_{};
  std::vector<TrackerSample> tracker_;
  std::vector<EcgBlock> ecg_;
};

}  // namespace perimap
