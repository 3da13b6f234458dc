// `perimap register`: where the tracker's frame is in the image's.
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/commands/live_capture.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/model_landmarks.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "daemon/setup/setup_report.hpp"
#include "daemon/setup/touch_guide.hpp"
#include "daemon/setup/touched_points.hpp"
#include "drivers/calibration/tool_tip.hpp"
#include "drivers/pose_file/point_table.hpp"

namespace perimap {
namespace {

struct RegisterOptions {
  CommonOptions common;
  std::string model;
  std::string touched;
  std::string recording;  // in place of `touched`
  std::string tool = "pointer";
  std::string tip;
  TouchRule touch;
  LiveOptions live;  // in place of a recording
  std::vector<std::vector<double>> targets;
  double tolerance_mm = 10.0;

  // What the result is made from.
  [[nodiscard]] std::vector<std::string> inputs() const {
    if (!live.configuration.empty()) return {model, live.configuration};
    return {model, recording.empty() ? touched : recording};
  }
};

SetupExpected<std::vector<Landmark>> landmarks_of(const RegisterOptions& options) {
  if (options.touched.empty() == options.recording.empty()) {
    return wrong_setup(
        "expected either touched landmarks with --touched or a recording of the touches with --from, or "
        "--live");
  }
  return read_landmarks({options.model, options.common.length_unit(), options.touched, options.recording, options.tool,
                         options.tip, options.touch});
}

SetupExpected<Measurement> measure(const RegisterOptions& options) {
  const auto landmarks = landmarks_of(options);
  if (!landmarks) return tl::unexpected(landmarks.error());
  const auto result = register_landmarks(*landmarks, options.tolerance_mm);
  if (!result) return tl::unexpected(result.error());
  if (!options.targets.empty() && landmarks->size() < 4) {
    return fail("--target: three landmarks fit almost anyhow, and tell no error; touch four of them and more");
  }
  std::vector<TargetError> targets;
  const double mm = options.common.length_unit() == LengthUnit::kMetre ? 1000.0 : 1.0;
  for (const std::vector<double>& target : options.targets) {
    const Vector3d target_I = mm * Vector3d(target.at(0), target.at(1), target.at(2));
    targets.push_back({target_I, expected_target_error_mm(*landmarks, target_I, result->fle_mm)});
  }
  Measurement measured{text_of(*result, *landmarks, targets), json_of(*result, *landmarks, targets), {}};
  measured.keys = {{"registration_translation_IW_mm", list_of(measured.json["translation_mm"])},
                   {"registration_rotation_IW_wxyz", list_of(measured.json["rotation_wxyz"])}};
  measured.plots = plots_of(*result);
  return measured;
}

// Before anything is recorded: what a live registration needs besides.
SetupExpected<std::unique_ptr<LiveGuide>> guide_of(const RegisterOptions& options) {
  if (options.tip.empty()) {
    return wrong_setup("--tip: expected the file of the pointer's tip that perimap calibrate tool --output wrote");
  }
  const auto tip = read_tool_tip(options.tip);
  if (!tip) return tl::unexpected(tip.error());
  auto model = read_point_table(options.model, options.common.length_unit());
  if (!model) return tl::unexpected(model.error());
  return touch_guide(*std::move(model), tip->tip_T, options.touch, options.tolerance_mm);
}

Outcome run(RegisterOptions& options, const Console& console) {
  const std::vector<std::string> inputs = options.inputs();
  if (auto able = check_outputs(options.common, {options.model, options.touched, options.recording, options.tip});
      !able) {
    return able;
  }
  const auto registered = [&] { return finish(measure(options), options.common, joined(inputs), options.recording); };
  if (options.live.configuration.empty()) return registered();
  if (!options.touched.empty()) {
    return refuse("--live and --touched: expected one of them", ExitCode::kWrongUsage);
  }
  const auto guide = guide_of(options);
  if (!guide) return refuse(guide.error());
  options.live.unregistered = true;
  return with_recording(options.live, options.tool, **guide, console, options.recording, registered);
}

}  // namespace

void add_register_command(Commands& commands) {
  const auto options = std::make_shared<RegisterOptions>();
  Command& command = commands.add(
      "register", "The place of the tracker's frame in the image's, by landmarks touched with a calibrated tool",
      [options](const Console& console) { return run(*options, console); });
  command.add_option("--model", options->model, "The landmarks in the image's frame: name,x,y,z")->required();
  command.add_option("--touched", options->touched, "The same, as touched, in the tracker's frame");
  add_from(command, options->recording);
  add_live(command, options->live);
  command.add_option("--tip", options->tip,
                     "With --from or --live: the tip of the tool that touches, by perimap calibrate tool");
  command.add_option("--tool", options->tool, "With --from or --live: the tool that touches")->capture_default_str();
  command
      .add_option("--touch-s", options->touch.shortest_s,
                  "With --from or --live: what is held still for so long is a touch")
      ->check(Range(0.5, 60.0))
      ->capture_default_str();
  command
      .add_option("--touch-radius-mm", options->touch.radius_mm, "With --from or --live: within this it is held still")
      ->check(Range(0.1, 50.0))
      ->capture_default_str();
  command
      .add_option_function<std::vector<double>>(
          "--target", [options](const std::vector<double>& target) { options->targets.push_back(target); },
          "x y z in the image's frame, where the expected error is told; in the unit of the files (--unit)")
      ->expected(3)
      ->trigger_on_parse();
  command.add_option("--tolerance-mm", options->tolerance_mm, "A landmark off by more is another point")
      ->check(Range(0.1, 1000.0))
      ->capture_default_str();
  add_common(command, options->common, true, true);
}

}  // namespace perimap
