// `perimap register`: where the tracker's frame is in the image's.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/command_line/commands.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "daemon/setup/setup_report.hpp"
#include "drivers/pose_file/point_table.hpp"

namespace perimap {
namespace {

struct Options {
  CommonOptions common;
  std::string model;
  std::string touched;
  std::vector<std::vector<double>> targets;
  double tolerance_mm = 10.0;
};

Expected<std::vector<Landmark>> landmarks_of(const Options& options) {
  const auto model = read_point_table(options.model, options.common.length_unit());
  if (!model) return tl::unexpected(model.error());
  const auto touched = read_point_table(options.touched, options.common.length_unit());
  if (!touched) return tl::unexpected(touched.error());
  std::vector<Landmark> landmarks;
  for (const NamedPoint& point : *touched) {
    const auto found =
        std::find_if(model->begin(), model->end(), [&](const NamedPoint& p) { return p.name == point.name; });
    if (found == model->end()) {
      return fail(fmt::format("{}: landmark '{}' is not in {}", options.touched, point.name, options.model));
    }
    landmarks.push_back({point.name, found->p, point.p});
  }
  return landmarks;
}

Expected<Measurement> measure(const Options& options) {
  const auto landmarks = landmarks_of(options);
  if (!landmarks) return tl::unexpected(landmarks.error());
  const auto result = register_landmarks(*landmarks, options.tolerance_mm);
  if (!result) return tl::unexpected(result.error());
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

}  // namespace

void add_register_command(Commands& commands) {
  const auto options = std::make_shared<Options>();
  Command& command = commands.add(
      "register", "The place of the tracker's frame in the image's, by landmarks touched with a calibrated tool",
      [options](const Console&) -> Outcome {
        const std::vector<std::string> inputs = {options->model, options->touched};
        if (auto able = check_outputs(options->common, inputs); !able) return able;
        return finish(measure(*options), options->common, joined(inputs));
      });
  command.add_option("--model", options->model, "The landmarks in the image's frame: name,x,y,z")->required();
  command.add_option("--touched", options->touched, "The same, as touched, in the tracker's frame")->required();
  command
      .add_option_function<std::vector<double>>(
          "--target", [options](const std::vector<double>& target) { options->targets.push_back(target); },
          "x y z in the image's frame, where the expected error is told")
      ->expected(3)
      ->trigger_on_parse();
  command.add_option("--tolerance-mm", options->tolerance_mm, "A landmark off by more is another point")
      ->check(Range(0.1, 1000.0))
      ->capture_default_str();
  add_common(command, options->common, true, true);
}

}  // namespace perimap
