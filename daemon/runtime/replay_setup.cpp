#include "daemon/runtime/replay_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/surface_traffic.hpp"
#include "daemon/config/wrong_key.hpp"
#include "daemon/runtime/calibration_fit.hpp"
#include "daemon/runtime/configured_model.hpp"
#include "daemon/runtime/configured_scope.hpp"
#include "daemon/runtime/tool_tips.hpp"
#include "drivers/calibration/calibration_file.hpp"
#include "drivers/calibration/tool_tip.hpp"
#include "drivers/calibration/turned_scope_file.hpp"
#include "drivers/recording/channels.hpp"

namespace perimap {
namespace {

// The attachments and facts of a recording that set the pipeline up.
struct RecordingFacts {
  std::optional<std::string> calibration;
  std::optional<std::string> configuration;
  std::optional<std::string> turned_scope;
  Duration utc_minus_monotonic{0};
  std::optional<std::string> world_frame;
};

Expected<RecordingFacts> read_facts(const std::string& path, ReadMode mode) {
  auto reader = RecordingReader::open(path, mode);
  if (!reader) return tl::unexpected(reader.error());
  RecordingFacts facts;
  const auto names = reader->attachment_names();
  const auto attached = [&](std::string_view name) -> Expected<std::optional<std::string>> {
    if (std::find(names.begin(), names.end(), name) == names.end()) return std::optional<std::string>();
    auto text = reader->attachment(name);
    if (!text) return tl::unexpected(text.error());
    return std::optional<std::string>(std::move(*text));
  };
  auto calibration = attached(attachments::kCalibration);
  if (!calibration) return tl::unexpected(calibration.error());
  facts.calibration = std::move(*calibration);
  auto configuration = attached(attachments::kConfiguration);
  if (!configuration) return tl::unexpected(configuration.error());
  facts.configuration = std::move(*configuration);
  auto turned_scope = attached(attachments::kTurnedScope);
  if (!turned_scope) return tl::unexpected(turned_scope.error());
  facts.turned_scope = std::move(*turned_scope);

  const auto channels = reader->channels();
  const bool has_info = std::any_of(channels.begin(), channels.end(),
                                    [](const RecordedChannel& c) { return c.name == channels::kRecordingInfo; });
  if (!has_info) return facts;
  const std::string_view info_channel[] = {channels::kRecordingInfo};
  if (auto selected = reader->select(info_channel); !selected) return tl::unexpected(selected.error());
  const auto message = reader->next();
  if (!message) return tl::unexpected(message.error());
  if (!*message) return facts;
  const auto info = reader->decode<perimap_RecordingInfo>(**message);
  if (!info) return tl::unexpected(info.error());
  facts.utc_minus_monotonic = Duration((*info)->utc_minus_monotonic_ns);
  if ((*info)->world_frame_id != nullptr) facts.world_frame = (*info)->world_frame_id;
  return facts;
}

// Tips that a recording has with it, by the names of their tools.
Expected<std::map<std::string, TipInTool>> read_tips(const std::string& path, ReadMode mode) {
  auto reader = RecordingReader::open(path, mode);
  if (!reader) return tl::unexpected(reader.error());
  constexpr std::string_view kEnd = ".json";
  std::map<std::string, TipInTool> tips;
  for (const std::string& name : reader->attachment_names()) {
    if (!name.starts_with(attachments::kTips) || !name.ends_with(kEnd)) continue;
    const auto text = reader->attachment(name);
    if (!text) return tl::unexpected(text.error());
    const auto tip = parse_tool_tip(*text, fmt::format("{}:{}", path, name));
    if (!tip) return tl::unexpected(tip.error());
    const std::size_t length = name.size() - attachments::kTips.size() - kEnd.size();
    tips[name.substr(attachments::kTips.size(), length)] = {tip->tip_T, tip->covariance_T};
  }
  return tips;
}

// In the file, or where there is none in the recording's own configuration.
Error told_of(const std::optional<std::filesystem::path>& configuration_file, const std::string& recording,
              WrongKeys wrong) {
  return configuration_file ? told_in(*configuration_file, std::move(wrong)) : told_in(recording, "", std::move(wrong));
}

}  // namespace

PipelineSettings pipeline_settings(const Configuration& c, const CameraModel& camera) {
  PipelineSettings s;
  s.camera = camera;
  s.watch_scope = true;
  s.pictures_may_loop = c.camera.repeats_allowed || c.camera.plays_video_in_loop();
  s.ecg_may_loop = c.ecg.repeats_allowed;
  const double(&t)[3] = c.tracker.translation_SC_mm;
  s.pose.X_SC = pose_from_wxyz(Vector3d(t[0], t[1], t[2]), c.tracker.rotation_SC_wxyz);
  s.pose.position_deviation_mm = c.tracker.position_deviation_mm / std::numbers::sqrt3;
  s.pose.rotation_deviation_rad = c.tracker.rotation_deviation_rad / std::numbers::sqrt3;
  s.pose.error_correlation = c.tracker.error_correlation;
  s.pose.time_offset = c.tracker.time_offset;
  s.pose.maximum_extrapolation = c.tracker.maximum_extrapolation;
  s.clock.law.law = c.phase.law.value_or(PhaseLaw::kLinear);
  s.law_from_image = !c.phase.law && c.phase.from_image;
  s.clock.lost_after = c.phase.lost_after;
  s.clock.predictor = c.phase.predictor;
  s.image_alone = c.phase.image_alone;
  if (c.ecg.r_trigger) s.r_trigger = RTriggerSettings{c.ecg.r_trigger_delay, c.ecg.r_trigger_deviation};
  s.respiration.enabled = c.respiration.enabled;
  s.respiration.channel = c.respiration.channel;
  s.respiration.search.shortest_period = c.respiration.shortest_period;
  s.respiration.search.longest_period = c.respiration.longest_period;
  s.respiration.displacement_mm = c.respiration.displacement_deviation_mm;
  // The tracker's noise moves the whole surface too.
  s.respiration.suspected_rms_mm = std::max(0.5, 2.0 * c.tracker.position_deviation_mm);
  if (c.respiration.enabled) s.estimator.layout.respiratory_harmonics = kBreathHarmonics;
  s.phase_from_image = c.phase.from_image;
  s.features.maximum = c.features.maximum;
  s.features.detection_interval = c.features.detection_interval;
  s.features.minimum_distance_px = c.features.minimum_distance_px;
  s.estimator.layout.cardiac_harmonics = c.estimation.harmonics;
  s.estimator.precision = c.estimation.precision;
  s.estimator.prior.dc_mm = c.estimation.prior_dc_deviation_mm;
  s.estimator.prior.cardiac_mm = c.estimation.prior_harmonic_deviation_mm;
  s.estimator.update.method = c.estimation.update;
  s.estimator.update.step_factor = c.estimation.step_factor;
  s.estimator.update.max_iterations = c.estimation.iterations;
  s.estimator.update.tolerance = c.estimation.tolerance;
  s.estimator.update.gate = c.estimation.gate_chi2;
  s.estimator.batch.gate = c.estimation.gate_chi2;
  s.estimator.batch.start_depths_mm = c.estimation.start_depths_mm;
  s.estimator.batch.prior_depth_mm = c.estimation.start_depths_mm[c.estimation.start_depths_mm.size() / 2];
  s.estimator.start_observations = c.estimation.start_observations;
  s.estimator.pixel_deviation_px = c.estimation.pixel_deviation_px;
  constexpr double kUsual_mm = 1.0;  // what 0 means
  s.estimator.converged_deviation_mm =
      c.estimation.converged_deviation_mm > 0.0 ? c.estimation.converged_deviation_mm : kUsual_mm;
  s.use_within_mm = {c.use.display_mm, c.use.measure_mm, c.use.contact_mm};
  s.workers = c.pipeline.workers;
  s.latency = c.pipeline.latency;
  s.lead = c.pipeline.lead;
  s.frame_stream = c.pipeline.release != PipelineConfiguration::Release::kClock;
  if (c.pipeline.release != PipelineConfiguration::Release::kFrame) s.clock_period = clock_period(c.pipeline);
  s.budget = c.pipeline.budget;
  s.shedding = c.pipeline.shedding;
  s.validity = c.dds.surface_lifespan > Duration(0) ? c.dds.surface_lifespan : s.validity;
  s.adoption_delay = c.pipeline.adoption_delay;
  return s;
}

tl::expected<RecordedBasis, SetupError> recorded_basis(const std::string& recording,
                                                       const std::optional<std::filesystem::path>& configuration_file,
                                                       ReadMode mode) {
  const auto wrong_recording = [](Error error) { return tl::unexpected(SetupError{std::move(error), false}); };
  const auto wrong_configuration = [](Error error) { return tl::unexpected(SetupError{std::move(error), true}); };
  auto facts = read_facts(recording, mode);
  if (!facts) return wrong_recording(std::move(facts.error()));
  RecordedBasis basis;
  basis.utc_minus_monotonic = facts->utc_minus_monotonic;
  Configuration& configuration = basis.configuration;
  if (facts->world_frame) configuration.source.world_frame = *facts->world_frame;
  if (facts->configuration) {
    const std::string name = fmt::format("{}:{}", recording, attachments::kConfiguration);
    auto own = parse_recorded_configuration(*facts->configuration, name, configuration,
                                            mode == ReadMode::kWhole ? OtherKeys::kPassedOver : OtherKeys::kRefused);
    if (!own) return wrong_recording(std::move(own.error()));
    configuration = std::move(own->configuration);
    basis.sensor = std::move(configuration.tracker.sensor);
    basis.second_sensor = std::move(configuration.tracker.second_sensor);
    configuration.tracker.sensor.reset();
    configuration.tracker.pointer.reset();
    configuration.tracker.second_sensor.reset();
    configuration.tracker.patient_tool.reset();
    basis.passed_over = std::move(own->passed_over);
  }
  if (configuration_file) {
    auto overlaid = load_configuration(*configuration_file, configuration);
    if (!overlaid) return wrong_configuration(std::move(overlaid.error()));
    configuration = std::move(*overlaid);
  }

  Expected<CameraModel> camera = fail("");
  if (configuration.camera.calibration) {
    camera = read_calibration(*configuration.camera.calibration);
    if (!camera) return wrong_configuration(std::move(camera.error()));
  } else if (facts->calibration) {
    camera = parse_calibration(*facts->calibration, fmt::format("{}:{}", recording, attachments::kCalibration));
    if (!camera) return wrong_recording(std::move(camera.error()));
  } else {
    return wrong_configuration(Error{fmt::format(
        "{}: no camera calibration is attached; expected key 'camera.calibration' to name one", recording)});
  }
  basis.camera = *camera;
  auto scope = configured_scope(configuration, *camera);
  if (!scope) return wrong_configuration(told_of(configuration_file, recording, std::move(scope.error())));
  basis.turned_scope = *scope;
  if (!basis.turned_scope && facts->turned_scope) {
    auto own = parse_turned_scope(*facts->turned_scope, fmt::format("{}:{}", recording, attachments::kTurnedScope));
    if (!own) return wrong_recording(std::move(own.error()));
    basis.turned_scope = *own;
  }
  return basis;
}

tl::expected<ReplaySetup, SetupError> prepare_replay(const std::string& recording,
                                                     const std::optional<std::filesystem::path>& configuration_file,
                                                     ReadMode mode) {
  auto basis = recorded_basis(recording, configuration_file, mode);
  if (!basis) return tl::unexpected(std::move(basis.error()));
  WrongKeys wrong;
  if (configuration_file) {
    if (basis->sensor) basis->configuration.tracker.sensor = basis->sensor;
    if (basis->second_sensor) basis->configuration.tracker.second_sensor = basis->second_sensor;
    wrong = wrong_calibrations(basis->configuration);
  }
  auto reader = ReplayReader::open_with_tools(recording, mode);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  if (basis->configuration.ecg.r_trigger && !reader->has_r_trigger()) {
    wrong.push_back({"ecg.r_trigger", fmt::format("expected false, since {} holds no channel {}, got true", recording,
                                                  channels::kRTrigger)});
  }
  if (basis->turned_scope && basis->turned_scope->second_sensor && !reader->has_second_sensor()) {
    wrong.push_back({"camera.turned_scope",
                     fmt::format("expected one that is read in the pictures, since {} holds no channel {}, got one "
                                 "whose turn a second sensor tells",
                                 recording, channels::kSecondSensor)});
  }
  auto model = configured_model(basis->configuration.model);
  if (!model) wrong.insert(wrong.end(), model.error().begin(), model.error().end());
  if (!wrong.empty()) return wrong_setup(told_of(configuration_file, recording, std::move(wrong)));
  reader->require_frame_size(basis->camera.width, basis->camera.height);
  PipelineSettings pipeline = pipeline_settings(basis->configuration, basis->camera);
  pipeline.turned_scope = basis->turned_scope;
  pipeline.organ_model = *std::move(model);
  const Identity identity{basis->configuration.source.name, first_stream(pipeline),
                          basis->configuration.source.world_frame};
  const auto tips = read_tips(recording, mode);
  if (!tips) return tl::unexpected(SetupError{tips.error(), false});
  auto tools = watched_tools(reader->tools(), basis->configuration.tracker, [&](const std::string& name) {
    const auto tip = tips->find(name);
    return tip == tips->end() ? std::nullopt : std::optional<TipInTool>(tip->second);
  });
  return ReplaySetup{std::move(basis->configuration), pipeline,           identity,        basis->utc_minus_monotonic,
                     std::move(basis->passed_over),   std::move(*reader), std::move(tools)};
}

RuntimeSettings runtime_settings(const Configuration& configuration, const Identity& identity) {
  RuntimeSettings settings;
  settings.identity = identity;
  settings.identity.run_id = new_run_id();
  settings.scheduling = {configuration.realtime.priority, configuration.realtime.cpus};
  settings.lock_memory = configuration.realtime.lock_memory;
  settings.phase_interval = kModelsApart;  // a model is made with a phase, if at all
  settings.model_interval = configuration.dds.surface_model_interval;
  settings.status_interval = configuration.status.interval;
  return settings;
}

}  // namespace perimap
