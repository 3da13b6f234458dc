#include "daemon/setup/model_landmarks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/setup/recorded_poses.hpp"
#include "drivers/calibration/tool_tip.hpp"

namespace perimap {
namespace {

// Of each landmark of the model, in the order of the table, where the tip was held still.
SetupExpected<std::vector<NamedPoint>> touched_in_recording(const LandmarkSource& source,
                                                            const std::vector<NamedPoint>& model) {
  if (source.tip.empty()) {
    return wrong_setup("--tip: expected the file of the pointer's tip that perimap calibrate tool --output wrote");
  }
  const auto tip = read_tool_tip(source.tip);
  if (!tip) return tl::unexpected(tip.error());
  const auto poses = read_recorded_poses(source.recording, source.tool);
  if (!poses) return tl::unexpected(poses.error());
  const TouchedPoints touched = touched_points(*poses, tip->tip_T, model, source.touch);
  if (touched.landmarks_W) return *touched.landmarks_W;
  std::string when;
  for (const Dwell& touch : touched.touches) {
    when += fmt::format("{}{:.1f}", when.empty() ? " at " : ", ", touch.begin_s - poses->front().t_s);
  }
  return fail(
      fmt::format("{}: {} touches of {:g} s and more are found{} s, and {} has {} landmarks: touch each once, in the "
                  "order of the table, hold the tip still for two seconds, and lift it in between",
                  source.recording, touched.touches.size(), source.touch.shortest_s, when, source.model, model.size()));
}

}  // namespace

SetupExpected<std::vector<Landmark>> read_landmarks(const LandmarkSource& source) {
  const auto model = read_point_table(source.model, source.unit);
  if (!model) return tl::unexpected(model.error());
  using Touched = SetupExpected<std::vector<NamedPoint>>;
  const auto touched = source.recording.empty() ? Touched(read_point_table(source.touched, source.unit))
                                                : touched_in_recording(source, *model);
  if (!touched) return tl::unexpected(touched.error());
  std::vector<Landmark> landmarks;
  for (const NamedPoint& point : *touched) {
    const auto found =
        std::find_if(model->begin(), model->end(), [&](const NamedPoint& p) { return p.name == point.name; });
    if (found == model->end()) {
      return fail(fmt::format("{}: landmark '{}' is not in {}", source.touched, point.name, source.model));
    }
    landmarks.push_back({point.name, found->p, point.p});
  }
  return landmarks;
}

}  // namespace perimap
