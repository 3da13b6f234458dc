#include "daemon/setup/commands/board_motion.hpp"

#include <utility>

#include "daemon/setup/lens_in_hand_eye.hpp"
#include "daemon/setup/live_guide.hpp"
#include "daemon/setup/recorded_poses.hpp"

namespace perimap {

void add_board_motion(Command& command, BoardMotionOptions& options) {
  add_from(command, options.recorded.recording);
  add_live(command, options.live);
  add_lens_and_board(command, options.recorded);
}

SetupExpected<HandEyeCalibration> hand_eye_of(const BoardMotionOptions& options, const HandEyeSettings& settings,
                                              const Console& console) {
  auto motion = motion_of(options.recorded, options.common.configuration, console);
  if (!motion) return tl::unexpected(motion.error());
  auto result = calibrate_hand_eye(std::move(motion->camera_poses), std::move(motion->sensor_poses), settings);
  if (!result) return fail(options.recorded.recording + ": " + result.error().message);
  if (const auto& covariance = motion->lens.covariance) {
    add_lens_uncertainty(*result, motion->board.views, motion->lens.camera, *covariance);
  }
  return *std::move(result);
}

Outcome measure_motion(BoardMotionOptions& options, const std::vector<std::string>& files, const Console& console,
                       const std::function<SetupExpected<Measurement>()>& measure) {
  // All that is read, but the configuration, which may take the result.
  std::vector<std::string> inputs = files;
  inputs.insert(inputs.end(), {options.recorded.recording, options.recorded.calibration});
  if (auto able = check_outputs(options.common, inputs); !able) return able;
  const bool live = !options.live.configuration.empty();
  options.recorded.live = options.live.configuration;
  const std::vector<std::string> named_files = named(files);
  if ((live || options.is_recorded()) && !named_files.empty()) {
    return refuse(joined(named_files) + ": not read beside --from or --live; expected one of them",
                  ExitCode::kWrongUsage);
  }
  if (live || options.is_recorded()) {
    if (const auto able = check_motion_options(options.recorded, options.common.configuration); !able) {
      return refuse(able.error());
    }
  }
  const std::string made_from = live                    ? options.live.configuration
                                : options.is_recorded() ? options.recorded.recording
                                                        : joined(named_files);
  constexpr double kLeast_s = 25.0;
  const auto guide = live_board_guide(options.live, options.recorded, options.common.configuration, kLeast_s);
  if (!guide) return refuse(guide.error());
  return with_recording(options.live, kScopeTool, **guide, console, options.recorded.recording,
                        [&] { return finish(measure(), options.common, made_from, options.recorded.recording); });
}

}  // namespace perimap
