#include "daemon/setup/recorded_verification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/config/wrong_key.hpp"
#include "daemon/runtime/calibration_fit.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "daemon/setup/recorded_relation.hpp"
#include "daemon/setup/recorded_sensor.hpp"
#include "daemon/setup/scope_rotation.hpp"
#include "drivers/calibration/tool_tip.hpp"
#include "drivers/calibration/turned_scope_file.hpp"

namespace perimap {
namespace {

Expected<std::optional<TouchOnTrial>> touch_of(const VerificationSource& source) {
  if (source.tip.empty()) return std::nullopt;
  const auto tip = read_tool_tip(source.tip);
  if (!tip) return tl::unexpected(tip.error());
  const auto poses = poses_beside_board(source.motion, source.tool);
  if (!poses) return tl::unexpected(poses.error());
  TouchOnTrial touch;
  for (const TimedPose& pose : *poses) touch.tip_W.push_back({pose.t_s, pose.X * tip->tip_T});
  touch.touched_B = source.touched_B;
  touch.tip_deviation_mm = std::sqrt(std::max(0.0, tip->covariance_T.trace()));
  return touch;
}

Vector3d middle_of(const std::vector<TimedView>& views) {
  Vector3d sum = Vector3d::Zero();
  double count = 0.0;
  for (const TimedView& seen : views) {
    for (const Vector3d& p : seen.view.board_mm) sum += p, count += 1.0;
  }
  return sum / std::max(1.0, count);
}

// The set-up as the scope was turned and zoomed while it was recorded.
struct SetupAsTurned {
  Pose X_SC;
  LensAtTurn lens;
};

SetupExpected<SetupAsTurned> setup_as_turned(const std::filesystem::path& file, const std::string& recording) {
  const auto scope = read_turned_scope(file);
  if (!scope) return wrong_setup(scope.error());
  if (scope->second_sensor) {
    const auto relation = relation_in_recording(recording);
    if (!relation) return tl::unexpected(relation.error());
    const double rotation_rad = scope->second_sensor->rotation_rad(relation->R_S2);
    constexpr double kSlipped_rad = 2.0 * kDegree;
    if (const double aside_rad = scope->second_sensor->aside_rad(relation->R_S2); aside_rad > kSlipped_rad) {
      return fail(
          fmt::format("{}: the two sensors are {:.1f} degrees from every turn about the shaft that {} has: one "
                      "has slipped; fasten it, and measure the scope anew",
                      recording, aside_rad / kDegree, file.string()));
    }
    return SetupAsTurned{scope->at(rotation_rad).X_SC, *scope->lens_at(rotation_rad, 0.0)};
  }
  const auto rotation = rotation_in_recording(recording);
  if (!rotation) return tl::unexpected(rotation.error());
  constexpr double kHeld_rad = 2.0 * kDegree;
  if (rotation->spread_rad > kHeld_rad) {
    return fail(recording + ": the scope was turned in its camera head meanwhile; hold it, and record again");
  }
  const auto lens = scope->lens_at(rotation->rotation_rad, rotation->radius_px);
  if (!lens) {
    return fail(fmt::format("{}: is of a zoom that {} has not: zoom back, or measure lens and scope at this zoom too",
                            recording, file.string()));
  }
  return SetupAsTurned{scope->at(rotation->rotation_rad).X_SC, *lens};
}

// What is on trial must be of the sensors whose poses were recorded. Lens and tip may be others than the
// configuration's.
SetupExpected<void> sensor_fits(Configuration configuration, const VerificationSource& source) {
  auto sensor = calibrated_sensor(source.motion.recording, configuration, source.configuration);
  if (!sensor) return tl::unexpected(sensor.error());
  configuration.tracker.sensor = *std::move(sensor);
  auto second = recorded_handle(source.motion.recording, kSecondSensorTool);
  if (!second) return tl::unexpected(second.error());
  if (*second) configuration.tracker.second_sensor = *std::move(second);
  configuration.tracker.pointer_calibration.reset();
  configuration.camera.calibration.reset();
  configuration.camera.width = configuration.camera.height = 0;
  if (auto wrong = wrong_calibrations(configuration); !wrong.empty()) {
    return wrong_setup(told_in(source.configuration, std::move(wrong)));
  }
  return {};
}

}  // namespace

SetupExpected<Verification> verify_recording(
    const VerificationSource& source, const std::function<void(std::uint64_t done, std::uint64_t all)>& progress) {
  const auto configuration = load_configuration(source.configuration, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return wrong_setup(configuration.error());
  if (const auto fits = sensor_fits(*configuration, source); !fits) return tl::unexpected(fits.error());
  const TrackerConfiguration& tracker = configuration->tracker;
  SetupOnTrial setup{
      pose_from_wxyz(Vector3d(tracker.translation_SC_mm[0], tracker.translation_SC_mm[1], tracker.translation_SC_mm[2]),
                     tracker.rotation_SC_wxyz),
      to_seconds(tracker.time_offset)};
  MotionSource recorded = source.motion;
  if (configuration->camera.turned_scope) {
    const auto turned = setup_as_turned(*configuration->camera.turned_scope, recorded.recording);
    if (!turned) return tl::unexpected(turned.error());
    setup.X_SC = turned->X_SC;
    recorded.lens_as_turned = turned->lens;
  }
  const auto touch = touch_of(source);
  if (!touch) return tl::unexpected(touch.error());
  const auto motion = recorded_motion(recorded, progress);
  if (!motion) return tl::unexpected(motion.error());
  auto result = verify_setup(motion->camera_poses, motion->sensor_poses, middle_of(motion->board.views), setup, *touch,
                             source.bound_mm);
  if (!result) return fail(source.motion.recording + ": " + result.error().message);
  return *std::move(result);
}

}  // namespace perimap
