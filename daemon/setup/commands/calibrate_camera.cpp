#include "daemon/setup/commands/calibrate_camera.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/board.hpp"
#include "daemon/setup/camera_calibration.hpp"
#include "daemon/setup/camera_report.hpp"
#include "daemon/setup/commands/board_options.hpp"
#include "daemon/setup/commands/frame_progress.hpp"
#include "daemon/setup/commands/live_capture.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/live_guide.hpp"
#include "daemon/setup/pictures.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "daemon/setup/recorded_date.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "daemon/setup/setup_plots.hpp"

namespace perimap {
namespace {

struct CameraOptions {
  CommonOptions common;
  std::vector<std::string> pictures;
  std::string recording;
  LiveOptions live;
  BoardOptions board;
  std::string lens = "brown-conrady";
};

// What is measured, wherever the views come from.
struct SeenBoard {
  Board board;
  std::vector<BoardView> views;
  std::vector<std::string> without;  // pictures that do not show it
  std::size_t pictures = 0;
  int width = 0;
  int height = 0;
};

Expected<SeenBoard> seen_in_pictures(const CameraOptions& options, const BoardWish& wish) {
  const auto pictures = read_pictures(options.pictures);
  if (!pictures) return tl::unexpected(pictures.error());
  std::vector<GreyImage> greys;
  for (const NamedPicture& picture : *pictures) greys.push_back(picture.grey());
  const auto board = recognise_board(greys, wish);
  if (!board) return tl::unexpected(board.error());
  SeenBoard seen{*board, {}, {}, pictures->size(), greys.front().width, greys.front().height};
  for (const NamedPicture& picture : *pictures) {
    auto view = find_board(picture.grey(), *board);
    if (!view) {
      seen.without.push_back(picture.name);
      continue;
    }
    view->name = picture.name;
    seen.views.push_back(*std::move(view));
  }
  return seen;
}

Expected<SeenBoard> seen_in_recording(const CameraOptions& options, const BoardWish& wish, const Console& console) {
  constexpr double kFrames_per_s = 2.0;
  auto found = find_recorded_board(options.recording, wish, kFrames_per_s, FrameProgress(console));
  if (!found) return tl::unexpected(found.error());
  SeenBoard seen{found->board, {}, {}, found->frames, found->width, found->height};
  for (TimedView& view : found->views) seen.views.push_back(std::move(view.view));
  return seen;
}

SetupExpected<Measurement> measure(const CameraOptions& options, const Console& console) {
  const auto wish = wish_of(options.board);
  if (!wish) return tl::unexpected(wish.error());
  const auto seen =
      options.recording.empty() ? seen_in_pictures(options, *wish) : seen_in_recording(options, *wish, console);
  if (!seen) return tl::unexpected(seen.error());
  if (seen->views.empty()) {
    return fail(
        fmt::format("no board is seen in any of the {} pictures (looked for: {}): is it whole in the picture, sharp "
                    "and evenly lit?",
                    seen->pictures, name_of(seen->board)));
  }
  CameraCalibrationSettings settings;
  if (options.lens == "fisheye") settings.lens = Lens::kKannalaBrandt;
  const auto result = calibrate_camera(seen->views, seen->width, seen->height, settings);
  if (!result) {
    return fail(fmt::format("{} (looked for: {}; {} of {} pictures show it)", result.error().message,
                            name_of(seen->board), seen->views.size(), seen->pictures));
  }
  Measurement measured;
  measured.text = text_of(*result, seen->board, seen->without);
  measured.json = json_of(*result, seen->board, seen->without);
  measured.plots = plots_of(*result);
  measured.file = calibration_text_of(*result, seen->board, date_of_measurement(options.recording));
  measured.section = "camera";
  measured.keys = {{"calibration", output_key(options.common)}};
  return measured;
}

std::string made_from(const CameraOptions& options) {
  if (!options.live.configuration.empty()) return options.live.configuration;
  if (!options.recording.empty()) return options.recording;
  if (options.pictures.size() <= 3) return joined(options.pictures);
  return fmt::format("{} and {} more", options.pictures.front(), options.pictures.size() - 1);
}

Outcome run(CameraOptions& options, const Console& console) {
  if (!options.common.configuration.empty() && options.common.output.empty()) {
    return refuse("--configuration: expected --output too, the calibration file that the configuration is to name",
                  ExitCode::kWrongUsage);
  }
  std::vector<std::string> inputs = options.pictures;
  inputs.push_back(options.recording);
  if (auto able = check_outputs(options.common, inputs); !able) return able;
  const int ways = (options.pictures.empty() ? 0 : 1) + (options.recording.empty() ? 0 : 1) +
                   (options.live.configuration.empty() ? 0 : 1);
  if (ways != 1) {
    return refuse("expected pictures of a board, a recording with --from, or devices with --live",
                  ExitCode::kWrongUsage);
  }
  const auto wish = wish_of(options.board);
  if (!wish) return refuse(wish.error());
  const std::string from = made_from(options);
  // Sixty views, of two a second.
  constexpr double kLeast_s = 30.0;
  const auto guide = board_guide(*wish, std::nullopt, kLeast_s);
  return with_recording(options.live, kScopeTool, *guide, console, options.recording,
                        [&] { return finish(measure(options, console), options.common, from, options.recording); });
}

}  // namespace

void add_calibrate_camera(Commands& commands, Command& calibrate) {
  const auto options = std::make_shared<CameraOptions>();
  Command& command =
      commands.add(calibrate, "camera", "Focal lengths, principal point and distortion, from pictures of a board",
                   [options](const Console& console) { return run(*options, console); });
  command.add_option("IMAGES", options->pictures, "Pictures of one board, folders of them, or a video");
  add_from(command, options->recording);
  add_live(command, options->live);
  add_board(command, options->board);
  command.add_option("--lens", options->lens, "Model of the distortion; fisheye for more than 120 degrees")
      ->check(OneOf({"brown-conrady", "fisheye"}))
      ->capture_default_str();
  add_common(command, options->common, false, true);
}

}  // namespace perimap
