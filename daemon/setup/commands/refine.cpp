// `perimap refine`: a registration by landmarks made better by a preoperative model of the organ.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/refinement/model_refinement.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/refinement_report.hpp"

namespace perimap {
namespace {

struct RefineOptions {
  CommonOptions common;
  RefinementSource source;
  double start_deg = 3.0;
};

// What the configuration's keys have to say after it. Without --registration the session was registered by them
// already, and what was found comes on top.
SetupExpected<Pose> registration_to_keep(const RefineOptions& options, const Pose& X_IW) {
  if (!options.source.registration.empty() || options.common.configuration.empty()) return X_IW;
  const auto before = load_configuration(options.common.configuration, {}, NamedFiles::kMayBeMissing);
  if (!before) return wrong_setup(before.error());
  const auto& t = before->tracker.translation_IW_mm;
  return X_IW * pose_from_wxyz({t[0], t[1], t[2]}, before->tracker.rotation_IW_wxyz);
}

SetupExpected<Measurement> measure(const RefineOptions& options) {
  RefinementSource source = options.source;
  source.unit_mm = options.common.length_unit() == LengthUnit::kMetre ? 1000.0 : 1.0;
  source.start_rad = options.start_deg * kDegree;
  const auto refinement = refine_registration(source);
  if (!refinement) return tl::unexpected(refinement.error());
  if (!options.common.configuration.empty() && !refinement->fit.doubts.empty()) {
    return fail(fmt::format("{}: the configuration keeps its registration, for this one is doubted: {}", source.model,
                            refinement->fit.doubts.front()));
  }
  const auto kept = registration_to_keep(options, refinement->fit.estimate.X_IW);
  if (!kept) return tl::unexpected(kept.error());
  Measurement measured{text_of(*refinement, source), json_of(*refinement), {}};
  double q[4];
  rotation_to_wxyz(kept->R, q);
  measured.keys = {{"registration_translation_IW_mm", list_of({kept->t.x(), kept->t.y(), kept->t.z()})},
                   {"registration_rotation_IW_wxyz", list_of({q[0], q[1], q[2], q[3]})}};
  return measured;
}

Outcome run(const RefineOptions& options) {
  const RefinementSource& source = options.source;
  const std::vector<std::string> inputs = named({source.model, source.recording, source.registration, source.compare});
  if (auto able = check_outputs(options.common, inputs); !able) return able;
  return finish(measure(options), options.common, joined(inputs), source.recording);
}

}  // namespace

void add_refine_command(Commands& commands) {
  const auto options = std::make_shared<RefineOptions>();
  options->common.unit = "mm";
  Command& command = commands.add(
      "refine",
      "Make a registration better by a preoperative model of the organ: its surface is fitted to the one that was "
      "published",
      [options](const Console&) { return run(*options); });
  RefinementSource& source = options->source;
  command.add_option("--model", source.model, "The organ's surface in the image's frame: STL, PLY, OBJ or legacy VTK")
      ->required();
  command
      .add_option("--from", source.recording,
                  "A recording (MCAP) of what was published: by perimap watch --record or perimap replay --samples")
      ->required();
  command
      .add_option("--phase", source.cycle_share,
                  "When the model was imaged, as a share of the time from one R peak to the next (0.75 for 75 %)")
      ->required()
      ->check(Range(0.0, 0.999));
  command.add_option("--phase-deviation", source.cycle_share_deviation, "What that share may be off by")
      ->check(Range(0.0, 0.5))
      ->capture_default_str();
  command.add_option("--registration", source.registration,
                     "Where to start: what perimap register --output wrote [the session was registered already]");
  command.add_option("--start-mm", source.start_mm, "What the start may be off by, RMS, where it does not tell itself")
      ->check(Range(0.01, 100.0))
      ->capture_default_str();
  command.add_option("--start-deg", options->start_deg, "Likewise of its turn")
      ->check(Range(0.01, 90.0))
      ->capture_default_str();
  command.add_option("--shape-mm", source.shape_mm, "What the model's surface may be off by along its normal, RMS")
      ->check(Range(0.0, 20.0))
      ->capture_default_str();
  command.add_option("--shape-length-mm", source.shape_length_mm, "Over which distance that error changes")
      ->check(Range(1.0, 200.0))
      ->capture_default_str();
  command.add_option("--compare", source.compare,
                     "Tell the difference from another registration, as the true one that perimap simulate wrote");
  add_common(command, options->common, true, true);
}

}  // namespace perimap
