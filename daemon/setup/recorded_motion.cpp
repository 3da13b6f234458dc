#include "daemon/setup/recorded_motion.hpp"

#include <fmt/format.h>

#include <utility>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/wrong_key.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {

SetupExpected<KnownLens> lens_of(const MotionSource& source) {
  if (!source.calibration.empty()) {
    auto lens = read_calibration(source.calibration);
    if (!lens) return tl::unexpected(lens.error());
    return KnownLens{*lens, read_lens_covariance(source.calibration)};
  }
  for (const std::string& from : source.configurations) {
    if (from.empty()) continue;
    const auto loaded = load_configuration(from, {}, NamedFiles::kMayBeMissing);
    if (!loaded) return wrong_setup(loaded.error());
    if (!loaded->camera.calibration) continue;
    auto lens = read_calibration(*loaded->camera.calibration);
    if (!lens) return wrong_setup(told_in(from, {{"camera.calibration", lens.error().message}}));
    return KnownLens{*lens, read_lens_covariance(*loaded->camera.calibration)};
  }
  return wrong_setup(
      "the lens is not known: name its calibration with --calibration, or a configuration that has one with "
      "--configuration; perimap calibrate camera makes one");
}

SetupExpected<void> check_source(const MotionSource& source) {
  if (source.board.square_mm <= 0.0) {
    return wrong_setup(
        "--square-mm: expected the side of the board's squares, without which its distance is not known");
  }
  const auto camera = lens_of(source);
  if (!camera) return tl::unexpected(camera.error());
  return {};
}

Expected<std::vector<TimedPose>> poses_beside_board(const MotionSource& source, const std::string& tool) {
  auto poses = read_recorded_poses(source.recording, tool);
  if (!poses || source.board_tool.empty()) return poses;
  if (source.board_tool == tool) {
    return fail(fmt::format("--board-tool: expected a tool that is fast on the board, got '{}' itself", tool));
  }
  const auto board = read_recorded_poses(source.recording, source.board_tool);
  if (!board) return tl::unexpected(board.error());
  auto relative = in_frame_of(*board, *poses);
  if (relative.empty()) {
    return fail(fmt::format("{}: '{}' and '{}' are never seen at the same time: bring both into sight of the tracker",
                            source.recording, tool, source.board_tool));
  }
  return relative;
}

SetupExpected<RecordedMotion> recorded_motion(
    const MotionSource& source, const std::function<void(std::uint64_t done, std::uint64_t all)>& progress) {
  if (const auto able = check_source(source); !able) return tl::unexpected(able.error());
  auto lens = lens_of(source);
  if (!lens) return tl::unexpected(lens.error());
  CameraModel& camera = lens->camera;
  if (const auto& turned = source.lens_as_turned) {
    camera.fx = turned->focal_px.x(), camera.fy = turned->focal_px.y();
    camera.cx = turned->principal_px.x(), camera.cy = turned->principal_px.y();
  }
  auto sensor = poses_beside_board(source, kScopeTool);
  if (!sensor) return tl::unexpected(sensor.error());
  constexpr double kFrames_per_s = 15.0;
  auto board = find_recorded_board(source.recording, source.board, kFrames_per_s, progress);
  if (!board) return tl::unexpected(board.error());
  if (board->width != camera.width || board->height != camera.height) {
    return fail(
        fmt::format("{}: its frames are {}x{}, and the lens was calibrated with {}x{}: calibrate the camera as "
                    "it is used",
                    source.recording, board->width, board->height, camera.width, camera.height));
  }
  RecordedMotion motion{*std::move(board), *lens, {}, *std::move(sensor)};
  motion.camera_poses = camera_poses_of(motion.board.views, motion.lens.camera);
  if (motion.camera_poses.empty()) {
    return fail(fmt::format("{}: the board ({}) is in none of {} frames: keep it in view while the scope is swung",
                            source.recording, name_of(motion.board.board), motion.board.frames));
  }
  return motion;
}

}  // namespace perimap
