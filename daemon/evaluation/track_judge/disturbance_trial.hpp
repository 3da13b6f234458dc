// What becomes of features when something happens to the picture: the tracks of the pristine clip are the truth.
#pragma once

#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/evaluation/track_judge/clip.hpp"
#include "daemon/evaluation/track_judge/disturbance.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {

struct DisturbanceLimits {
  double begins_s = 1.2;        // of the clip
  double found_within_s = 1.0;  // of the picture's return
  // Off the pristine clip's track, at 1280 pixels of width; 1.5 px of the picture's own at least.
  double right_px = 5;
};

struct DisturbanceFigures {
  Disturbance disturbance = Disturbance::kBlood;
  std::size_t features = 0;  // tracked when it began, and in the pristine clip still in sight at the end
  std::size_t found = 0;     // of them, found again rightly
  std::size_t wrong = 0;     // of all that are tracked in that time and were before, those that are elsewhere
};

// `frame_at(step)` gives the pristine clip's frames, each valid until the next is asked for; there must be enough of
// them for the disturbance and what is before and after it. The error says that there are too few, or what is wrong
// with an image.
[[nodiscard]] Expected<DisturbanceFigures> try_disturbance(const std::function<VideoFrame(std::size_t)>& frame_at,
                                                           std::size_t frames, double frames_per_s, int features,
                                                           Disturbance disturbance,
                                                           const DisturbanceLimits& limits = {});

// All of them on a clip that is played there and back.
[[nodiscard]] Expected<std::vector<DisturbanceFigures>> try_disturbances(const Clip& clip, int features);
[[nodiscard]] std::string to_text(const std::vector<DisturbanceFigures>& all);
[[nodiscard]] nlohmann::json to_json(const std::vector<DisturbanceFigures>& all);

}  // namespace perimap
