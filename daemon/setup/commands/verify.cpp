// `perimap verify`: whether the set-up is right, before a session.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/runtime/last_verification.hpp"
#include "daemon/setup/commands/frame_progress.hpp"
#include "daemon/setup/commands/live_capture.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/kept_result.hpp"
#include "daemon/setup/live_guide.hpp"
#include "daemon/setup/recorded_date.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "daemon/setup/recorded_verification.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

struct VerifyOptions {
  CommonOptions common;
  std::string configuration;
  RecordedOptions recorded;
  bool live = false;
  double longest_s = 60.0;
  std::string tip;
  std::string tool = "pointer";
  std::vector<double> touched_mm{0.0, 0.0};
  double bound_mm = 2.0;
};

// What it is of: the configuration's hand-eye and clocks, and the lens that it was verified with.
SetupExpected<VerifiedSetUp> set_up_of(const VerifyOptions& options, const MotionSource& motion) {
  const auto configuration = load_configuration(options.configuration, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return wrong_setup(configuration.error());
  const auto lens = lens_of(motion);
  if (!lens) return tl::unexpected(lens.error());
  return verified_set_up_of(*configuration, lens->camera);
}

// Beside the configuration, for check, perimapd and each recording; passed or not. Where that folder is not this user's
// the result holds all the same.
void keep_record(const VerifyOptions& options, const MotionSource& motion, nlohmann::json result,
                 const Console& console) {
  const auto set_up = set_up_of(options, motion);
  result["date"] = date_of_measurement(options.recorded.recording);
  const auto file = verification_file_of(options.configuration);
  const auto written = set_up ? write_kept(file, format_verification(json_line(result), *set_up))
                              : Expected<void>(tl::unexpected(set_up.error().error));
  if (!written) {
    console.complain(fmt::format("note: not kept with the set-up, so that recordings will not tell of it: {}",
                                 written.error().message));
  } else if (!options.common.json) {
    fmt::print("kept as {}\n", file.string());
  }
}

Outcome verified(const VerifyOptions& options, const std::string& made_from, const Console& console) {
  auto motion = source_of(options.recorded, options.configuration);
  if (!motion) return refuse(motion.error());
  const Vector3d touched_B(options.touched_mm.at(0), options.touched_mm.at(1), 0.0);
  const auto result = verify_recording(
      {options.configuration, *motion, options.tip, options.tool, touched_B, options.bound_mm}, FrameProgress(console));
  if (!result) return refuse(result.error());
  Measurement measured{text_of(*result), json_of(*result), {}};
  measured.json["configuration"] = options.configuration;
  measured.plots = plots_of(*result);
  if (auto finished = finish(measured, options.common, made_from, options.recorded.recording); !finished)
    return finished;
  measured.json["made_from"] = made_from;
  keep_record(options, *motion, measured.json, console);
  if (!result->passed()) {
    return refuse(fmt::format("not within {:g} mm: {}", options.bound_mm, advice_of(*result)));
  }
  return {};
}

Outcome run(VerifyOptions& options, const Console& console) {
  const std::vector<std::string> inputs = {options.configuration, options.recorded.recording,
                                           options.recorded.calibration, options.tip};
  if (auto able = check_outputs(options.common, inputs); !able) return able;
  if (options.live == !options.recorded.recording.empty()) {
    return refuse("expected a recording with --from, or --live for the configuration's own devices",
                  ExitCode::kWrongUsage);
  }
  if (const auto sound = load_configuration(options.configuration, {}, NamedFiles::kMayBeMissing); !sound) {
    return refuse(sound.error(), ExitCode::kWrongUsage);
  }
  if (const auto able = check_motion_options(options.recorded, options.configuration); !able) {
    return refuse(able.error());
  }
  LiveOptions live;
  if (options.live) live.configuration = options.configuration;
  live.longest_s = options.longest_s;
  const std::string made_from = options.live ? options.configuration : options.recorded.recording;
  constexpr double kLeast_s = 10.0;
  // What is on trial is not measured anew, which would take longer.
  const auto source = source_of(options.recorded, options.configuration);
  if (!source) return refuse(source.error());
  const auto guide = board_guide(source->board, std::nullopt, kLeast_s, Turning::kWanted);
  return with_recording(live, kScopeTool, *guide, console, options.recorded.recording,
                        [&] { return verified(options, made_from, console); });
}

}  // namespace

void add_verify_command(Commands& commands) {
  const auto options = std::make_shared<VerifyOptions>();
  Command& command = commands.add(
      "verify", "Whether the set-up is right, before a session: the error on the spot, in mm, against a bound",
      [options](const Console& console) { return run(*options, console); });
  command.footer(
      "Swing the scope about a board that stays where it is, by 20 degrees and more about all axes, for ten seconds; "
      "with the tip of a calibrated pointer resting on a point of the board the error is absolute. Exit code 1: not "
      "within the bound, or not determined. What it says is kept beside the configuration, as NAME.verified.json, and "
      "goes "
      "with what perimapd and perimap record write; perimap check tells it.");
  command.add_option("CONFIGURATION", options->configuration, "The configuration on trial (TOML)")->required();
  command.add_option("--from", options->recorded.recording, "A recording of perimap record (MCAP)");
  command.add_flag("--live", options->live, "Of the configuration's own devices, now");
  command.add_option("--seconds", options->longest_s, "With --live: for so long at most")
      ->check(Range(10.0, 3600.0))
      ->capture_default_str();
  add_lens_and_board(command, options->recorded);
  command.add_option("--tip", options->tip, "The pointer's tip, as perimap calibrate tool --output wrote it");
  command.add_option("--tool", options->tool, "The tracked tool that is the pointer")->capture_default_str();
  command
      .add_option(
          "--touched", options->touched_mm,
          "x y of the touched point on the board, mm: from a chessboard's first inner corner, or from the upper "
          "left corner of a ChArUco board's squares, to the right and downwards")
      ->expected(2)
      ->capture_default_str();
  command.add_option("--bound-mm", options->bound_mm, "What the error and two of its deviations must not exceed")
      ->check(Range(0.01, 1000.0))
      ->capture_default_str();
  add_common(command, options->common, false, false);
}

}  // namespace perimap
