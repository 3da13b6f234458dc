#include "daemon/setup/commands/recorded_options.hpp"

#include <fmt/format.h>

#include "daemon/command_line/command.hpp"
#include "daemon/command_line/progress.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {

void add_from(Command& command, std::string& recording) {
  command.add_option("--from", recording, "A recording of perimap record (MCAP) in place of files");
}

void add_lens_and_board(Command& command, RecordedOptions& options) {
  command.add_option("--calibration", options.calibration,
                     "With --from: the lens, as perimap calibrate camera writes it [what the configuration names]");
  add_board(command, options.board);
}

SetupExpected<CameraModel> lens_of(const RecordedOptions& options, const std::string& configuration) {
  if (!options.calibration.empty()) return read_calibration(options.calibration);
  for (const std::string& from : {configuration, options.live}) {
    if (from.empty()) continue;
    const auto loaded = load_configuration(from, {}, NamedFiles::kMayBeMissing);
    if (!loaded) return wrong_setup(loaded.error());
    if (!loaded->camera.calibration) continue;
    auto lens = read_calibration(*loaded->camera.calibration);
    if (!lens) return wrong_setup(lens.error());
    return *lens;
  }
  return wrong_setup(
      "the lens is not known: name its calibration with --calibration, or a configuration that has one with "
      "--configuration; perimap calibrate camera makes one");
}

SetupExpected<void> check_motion_options(const RecordedOptions& options, const std::string& configuration) {
  const auto wish = wish_of(options.board);
  if (!wish) return tl::unexpected(wish.error());
  if (wish->square_mm <= 0.0) {
    return wrong_setup(
        "--square-mm: expected the side of the board's squares, without which its distance is not known");
  }
  const auto camera = lens_of(options, configuration);
  if (!camera) return tl::unexpected(camera.error());
  return {};
}

SetupExpected<RecordedMotion> recorded_motion(const RecordedOptions& options, const std::string& configuration,
                                              const Console& console) {
  if (const auto able = check_motion_options(options, configuration); !able) return tl::unexpected(able.error());
  const auto wish = wish_of(options.board);
  auto camera = lens_of(options, configuration);
  if (!camera) return tl::unexpected(camera.error());
  if (const auto& turned = options.lens_as_turned) {
    camera->fx = turned->focal_px.x(), camera->fy = turned->focal_px.y();
    camera->cx = turned->principal_px.x(), camera->cy = turned->principal_px.y();
  }
  auto sensor = read_recorded_poses(options.recording, kScopeTool);
  if (!sensor) return tl::unexpected(sensor.error());
  constexpr double kFrames_per_s = 15.0;
  std::optional<Progress> progress;
  auto board = find_recorded_board(options.recording, *wish, kFrames_per_s, [&](std::uint64_t done, std::uint64_t all) {
    if (!progress) progress.emplace(console, "frames", all);
    progress->update(done);
  });
  progress.reset();
  if (!board) return tl::unexpected(board.error());
  if (board->width != camera->width || board->height != camera->height) {
    return fail(
        fmt::format("{}: its frames are {}x{}, and the lens was calibrated with {}x{}: calibrate the camera as "
                    "it is used",
                    options.recording, board->width, board->height, camera->width, camera->height));
  }
  RecordedMotion motion{*std::move(board), *camera, {}, *std::move(sensor)};
  motion.camera_poses = camera_poses_of(motion.board.views, motion.camera);
  if (motion.camera_poses.empty()) {
    return fail(fmt::format("{}: the board ({}) is in none of {} frames: keep it in view while the scope is swung",
                            options.recording, name_of(motion.board.board), motion.board.frames));
  }
  return motion;
}

}  // namespace perimap
