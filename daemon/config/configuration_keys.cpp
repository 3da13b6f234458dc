#include "daemon/config/configuration_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "daemon/config/configuration_section.hpp"
#include "drivers/transport/camera_endpoint.hpp"
#include "drivers/transport/endpoint.hpp"

namespace perimap {
namespace {

constexpr int kVersion = 1;

// Reads and writes one member of a Configuration, const or not. A macro, because a member of a member has no pointer.
// NOLINTBEGIN(cppcoreguidelines-macro-usage,bugprone-macro-parentheses)
#define PERIMAP_MEMBER(path) \
  [](auto& configuration) -> auto& { return configuration.path; }
// NOLINTEND(cppcoreguidelines-macro-usage,bugprone-macro-parentheses)

void add_version(std::vector<ConfigurationKey>& keys) {
  Section("", keys).add(
      "version", "version of this file's format", fmt::format("{}", kVersion),
      [](const ConfigurationValue& value, Configuration&) {
        const auto* version = std::get_if<std::int64_t>(&value);
        return version != nullptr && *version == kVersion;
      },
      [](const Configuration&) -> std::optional<ConfigurationValue> { return std::int64_t{kVersion}; });
}

bool is_camera(const std::string& text) { return parse_camera_endpoint(text).has_value(); }

void add_sources(std::vector<ConfigurationKey>& keys) {
  Section("source", keys)
      .text("name", 63, PERIMAP_MEMBER(source.name), "key `source` of every published sample")
      .text("world_frame", 63, PERIMAP_MEMBER(source.world_frame), "name of the frame W, published as frame_id");
  Section("replay", keys)
      .file("recording", PERIMAP_MEMBER(replay.recording), "the recording to replay, from this file's folder");
  Section camera("camera", keys);
  camera
      .optional_text("device", R"("v4l2:/dev/videoN" or "video:FILE")", &is_camera, PERIMAP_MEMBER(camera.device),
                     "where the camera is: a V4L2 device, or a video file in its place")
      .add(
          "format",
          "what the camera is to give; any: the first of these that it has, at no much lower rate than the others",
          R"("any" or "nv12" or "yuyv" or "uyvy" or "mono8" or "jpeg")",
          [](const ConfigurationValue& value, Configuration& configuration) {
            const auto* name = std::get_if<std::string>(&value);
            if (name == nullptr) return false;
            configuration.camera.format = pixel_format_of_name(*name);
            return configuration.camera.format || *name == "any";
          },
          [](const Configuration& configuration) -> std::optional<ConfigurationValue> {
            const auto& format = configuration.camera.format;
            return format ? std::string(pixel_format_name(*format)) : "any";
          })
      .integer("width", 0, 16384, PERIMAP_MEMBER(camera.width), "of the frames; 0: the calibration's")
      .integer("height", 0, 16384, PERIMAP_MEMBER(camera.height), "of the frames; 0: the calibration's")
      .integer("input", -1, 63, PERIMAP_MEMBER(camera.input), "of a capture card with several; -1: as it is set")
      .number("frame_rate_hz", 0, 2000, PERIMAP_MEMBER(camera.frame_rate_hz), "0: as the camera or video has it")
      .number("exposure_ms", 0, 1000, PERIMAP_MEMBER(camera.exposure_ms),
              "0: as it is set; an automatic exposure is not known, so stamps are then off by half of it")
      .number("gain", -1, 1e6, PERIMAP_MEMBER(camera.gain), "in the camera's own steps; -1: as it is set")
      .duration("delay_ms", std::chrono::milliseconds(1), -100, 1000, PERIMAP_MEMBER(camera.delay),
                "how old the picture is when the camera's driver stamps it: scope processor, capture card")
      .flag("loop", PERIMAP_MEMBER(camera.loop), "a video begins anew at its end")
      .flag("repeats_allowed", PERIMAP_MEMBER(camera.repeats_allowed),
            "for trials: pictures may come again within 20 s, as of a video that is played in a loop in the camera's "
            "place; a camera that has hung and gives its memory is not noticed then")
      .file("calibration", PERIMAP_MEMBER(camera.calibration),
            "calibration as OpenCV writes it, from this file's folder; none: the recording's own")
      .file("turned_scope", PERIMAP_MEMBER(camera.turned_scope),
            "of a scope that is turned in its camera head, as `perimap calibrate scope` writes it: hand-eye and "
            "principal point then go by the notch in the pictures, or by tracker.second_sensor; none: the recording's "
            "own")
      .file("playback", PERIMAP_MEMBER(camera.playback), "a recording whose frames stand in for a camera")
      .number("playback_start_s", 0, 1e9, PERIMAP_MEMBER(camera.playback_start_s),
              "when that recording begins, CLOCK_MONOTONIC; 0: when perimapd starts");
}

// Where a device is, as a text; none: nowhere.
constexpr std::string_view kPort = R"(an absolute path of a serial port, "tcp:HOST:PORT" or "can:INTERFACE")";
bool is_endpoint(const std::string& text) { return parse_endpoint(text).has_value(); }

bool is_path(const std::string& text) { return text.starts_with('/') && text.find('\0') == std::string::npos; }

bool is_tool_name(const std::string& text) {
  constexpr std::size_t kLongest = 20;  // of OpenIGTLink's names
  return !text.empty() && text.size() <= kLongest &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c < 0x7F; });
}

// 2026-11-25, or as perimap writes it with the time of the day, 2026-11-25 18:30 UTC.
bool is_day(const std::string& text) {
  constexpr std::string_view kForm = "0000-00-00 00:00 UTC";
  constexpr std::size_t kDay = 10;
  if (text.size() != kDay && text.size() != kForm.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (kForm[i] == '0' ? !digit : text[i] != kForm[i]) return false;
  }
  const auto number = [&text](std::size_t at, std::size_t length) { return std::stoi(text.substr(at, length)); };
  const std::chrono::year_month_day day{std::chrono::year(number(0, 4)),
                                        std::chrono::month(static_cast<unsigned>(number(5, 2))),
                                        std::chrono::day(static_cast<unsigned>(number(8, 2)))};
  return day.ok();
}

constexpr std::size_t kMostInstruments = 8;

void add_tracker(std::vector<ConfigurationKey>& keys) {
  const auto ms = std::chrono::milliseconds(1);
  const auto s = std::chrono::seconds(1);
  const std::string tool = "a text of 1 to 20 printable characters";
  using Protocol = TrackerConfiguration::Protocol;
  const std::array<std::pair<std::string_view, Protocol>, 3> protocols{
      {{"none", Protocol::kNone}, {"ndi", Protocol::kNdi}, {"igtl", Protocol::kIgtl}}};
  const std::array<std::pair<std::string_view, bool>, 2> igtl_stamps{{{"sender", false}, {"arrival", true}}};
  Section("tracker", keys)
      .choice("protocol", protocols, PERIMAP_MEMBER(tracker.protocol), "what the tracker speaks")
      .optional_text("port", std::string(kPort), &is_endpoint, PERIMAP_MEMBER(tracker.port), "where the tracker is")
      .optional_text(
          "sensor", tool, &is_tool_name, PERIMAP_MEMBER(tracker.sensor),
          "the sensor's port handle (ndi, hexadecimal) or name (igtl); none: the only one that is no other's")
      .optional_text("reference", tool, &is_tool_name, PERIMAP_MEMBER(tracker.reference),
                     "the patient's reference tool, likewise; W is its frame; none: W is the tracker's")
      .optional_text("pointer", tool, &is_tool_name, PERIMAP_MEMBER(tracker.pointer),
                     "the tool that touches landmarks, likewise; recorded as tracker/pointer")
      .optional_text("second_sensor", tool, &is_tool_name, PERIMAP_MEMBER(tracker.second_sensor),
                     "the tool that tells how an angled scope is turned in its camera head, likewise: on the scope "
                     "where the sensor is on the head, or the other way round; recorded as tracker/second_sensor")
      .optional_text("patient_tool", tool, &is_tool_name, PERIMAP_MEMBER(tracker.patient_tool),
                     "the tool that is fixed to what holds the organ, and is moved as the organ is moved, likewise: it "
                     "tells a moved organ from a tracker that errs; recorded as tracker/patient_tool")
      .texts("instruments", kMostInstruments, "texts of 1 to 20 printable characters", &is_tool_name,
             PERIMAP_MEMBER(tracker.instruments), "further tools, likewise; each recorded as tracker/instrument/NAME")
      .file("sensor_definition", PERIMAP_MEMBER(tracker.sensor_definition),
            "the sensor's tool definition (.rom), uploaded to an ndi tracker")
      .file("reference_definition", PERIMAP_MEMBER(tracker.reference_definition),
            "the reference's tool definition, likewise")
      .file("pointer_definition", PERIMAP_MEMBER(tracker.pointer_definition), "the pointer's tool definition, likewise")
      .file("second_sensor_definition", PERIMAP_MEMBER(tracker.second_sensor_definition),
            "the second sensor's tool definition, likewise")
      .file("patient_tool_definition", PERIMAP_MEMBER(tracker.patient_tool_definition),
            "the patient tool's tool definition, likewise")
      .files("instrument_definitions", kMostInstruments, PERIMAP_MEMBER(tracker.instrument_definitions),
             "tool definitions, likewise, of further instruments; each has the name of its file")
      .file("pointer_calibration", PERIMAP_MEMBER(tracker.pointer_calibration),
            "the pointer's tip, as `perimap calibrate tool --output` writes it; one of another tool is refused")
      .files(
          "instrument_calibrations", kMostInstruments, PERIMAP_MEMBER(tracker.instrument_calibrations),
          "tips of instruments, likewise, each of the tool that it says; their distance from the surface is published")
      .number("frame_rate_hz", 1, 1000, PERIMAP_MEMBER(tracker.frame_rate_hz), "of the ndi tracker's frame numbers")
      .choice(
          "igtl_stamps", igtl_stamps, PERIMAP_MEMBER(tracker.igtl_stamps_by_arrival),
          "when an igtl tracker's poses were measured: as the sender stamps them, or, where its clock is no good, when "
          "they arrive")
      .pose("registration", "IW", PERIMAP_MEMBER(tracker.translation_IW_mm), PERIMAP_MEMBER(tracker.rotation_IW_wxyz),
            "registration X_IW: the place of W in the frame I, which is then published as source.world_frame",
            "registration X_IW: the orientation of W in the frame I")
      .number("position_deviation_mm", 0, 100, PERIMAP_MEMBER(tracker.position_deviation_mm),
              "position noise of the tracker, RMS of the 3-D norm")
      .angle("rotation_deviation_deg", 0, 45, PERIMAP_MEMBER(tracker.rotation_deviation_rad),
             "orientation noise of the tracker, RMS of the 3-D norm")
      .duration("error_correlation_s", s, 0, 1000, PERIMAP_MEMBER(tracker.error_correlation),
                "time in which the tracker's error falls to 1/e of what it was; 0: it is new at each frame")
      .duration("time_offset_ms", ms, -1000, 1000, PERIMAP_MEMBER(tracker.time_offset),
                "added to the tracker's stamps to get the camera's time")
      .duration("maximum_extrapolation_ms", ms, 0, 1000, PERIMAP_MEMBER(tracker.maximum_extrapolation),
                "a pose is extrapolated at most this far; beyond, a frame gives no measurement")
      .pose("hand_eye", "SC", PERIMAP_MEMBER(tracker.translation_SC_mm), PERIMAP_MEMBER(tracker.rotation_SC_wxyz),
            "hand-eye X_SC: the camera's place in the sensor's frame",
            "hand-eye X_SC: the camera's orientation in the sensor's frame")
      .optional_text("hand_eye_date", "a day, as 2026-11-25", &is_day, PERIMAP_MEMBER(tracker.hand_eye_date),
                     "when the hand-eye was measured")
      .optional_text("hand_eye_sensor", tool, &is_tool_name, PERIMAP_MEMBER(tracker.hand_eye_sensor),
                     "the sensor that it was measured of; where that is not tracker.sensor it is refused");
  Section("setup", keys)
      .number("maximum_age_days", 0, 36500, PERIMAP_MEMBER(setup.maximum_age_days),
              "check and probe warn of calibrations that are older; 0: of none");
}

void add_ecg(std::vector<ConfigurationKey>& keys) {
  const auto ms = std::chrono::milliseconds(1);
  using Protocol = EcgConfiguration::Protocol;
  const std::array<std::pair<std::string_view, Protocol>, 5> protocols{{{"none", Protocol::kNone},
                                                                        {"medlab", Protocol::kMedlab},
                                                                        {"bitalino", Protocol::kBitalino},
                                                                        {"cyton", Protocol::kCyton},
                                                                        {"can", Protocol::kCan}}};
  const std::array<std::pair<std::string_view, ModemLine>, 4> lines{{{"dcd", ModemLine::kCarrierDetect},
                                                                     {"cts", ModemLine::kClearToSend},
                                                                     {"dsr", ModemLine::kDataSetReady},
                                                                     {"ri", ModemLine::kRingIndicator}}};
  const std::array<std::pair<std::string_view, bool>, 2> edges{{{"rising", true}, {"falling", false}}};
  Section("ecg", keys)
      .choice("protocol", protocols, PERIMAP_MEMBER(ecg.protocol), "what the ECG device speaks")
      .optional_text("port", std::string(kPort), &is_endpoint, PERIMAP_MEMBER(ecg.port), "where the ECG device is")
      .integer("channel", 0, 8, PERIMAP_MEMBER(ecg.channel),
               "input of a bitalino (1 to 6) or cyton (1 to 8) that carries the ECG; 0: the usual one, 2 and 1")
      .integer("second_channel", 0, 8, PERIMAP_MEMBER(ecg.second_channel),
               "its input with a second lead of the same heart, of which one is enough at any time; 0: none")
      .number("count_mV", 0, 1000, PERIMAP_MEMBER(ecg.count_mV),
              "mV of one count of medlab and can; 0: the usual, 0.02 and 0.005")
      .number("can_sample_rate_hz", 100, 1000, PERIMAP_MEMBER(ecg.can_sample_rate_hz), "samples a second over can")
      .integer("can_identifier", 0, 0x1FFFFFFF, PERIMAP_MEMBER(ecg.can_identifier),
               "identifier of the frames of config/perimap_ecg.dbc")
      .flag("can_extended", PERIMAP_MEMBER(ecg.can_extended), "the identifier has 29 bits")
      .flag("repeats_allowed", PERIMAP_MEMBER(ecg.repeats_allowed),
            "for trials: samples may come again within 20 s, as of a record that is played in a loop in the patient's "
            "place; a device that has hung and gives its memory is not noticed then")
      .flag("r_trigger", PERIMAP_MEMBER(ecg.r_trigger),
            "R peaks come from a monitor's trigger line; samples are then not looked at")
      .optional_text("r_trigger_port", "an absolute path of a serial port", &is_path,
                     PERIMAP_MEMBER(ecg.r_trigger_port), "the serial port that the trigger is wired to")
      .choice("r_trigger_line", lines, PERIMAP_MEMBER(ecg.r_trigger_line),
              "its input with the trigger: carrier detect, clear to send, data set ready, ring indicator")
      .choice("r_trigger_edge", edges, PERIMAP_MEMBER(ecg.r_trigger_rising), "the edge that is the R peak")
      .duration("r_trigger_delay_ms", ms, -500, 500, PERIMAP_MEMBER(ecg.r_trigger_delay),
                "of the trigger after the R peak, as measured for the monitor")
      .duration("r_trigger_deviation_ms", ms, 0.1, 100, PERIMAP_MEMBER(ecg.r_trigger_deviation),
                "standard deviation of that delay from beat to beat");
}

void add_estimation(std::vector<ConfigurationKey>& keys) {
  const auto ms = std::chrono::milliseconds(1);
  const auto s = std::chrono::seconds(1);
  const std::array<std::pair<std::string_view, std::optional<PhaseLaw>>, 4> laws{
      {{"auto", std::nullopt},
       {"linear", PhaseLaw::kLinear},
       {"warped", PhaseLaw::kWarped},
       {"time-locked", PhaseLaw::kTimeLocked}}};
  const std::array<std::pair<std::string_view, RrMethod>, 3> predictors{
      {{"ar", RrMethod::kAutoregressive}, {"mean", RrMethod::kMeanOf8}, {"previous", RrMethod::kPrevious}}};
  Section("phase", keys)
      .choice("law", laws, PERIMAP_MEMBER(phase.law),
              "how the phase runs from one R peak to the next; auto: as the images show")
      .duration("lost_after_s", s, 0.5, 60, PERIMAP_MEMBER(phase.lost_after),
                "without an R peak for so long the phase is lost")
      .flag("from_image", PERIMAP_MEMBER(phase.from_image),
            "corrects the running cycle by what the features' motion in the image tells")
      .duration("image_alone_s", s, 0, 3600, PERIMAP_MEMBER(phase.image_alone),
                "without the ECG the images carry the phase on for so long, then it is lost")
      .choice("predictor", predictors, PERIMAP_MEMBER(phase.predictor),
              "what the next cycle's length is predicted from: autoregression, the mean of eight, the last");
  Section("respiration", keys)
      .flag("enabled", PERIMAP_MEMBER(respiration.enabled), "breathing is part of the motion model")
      .flag("channel", PERIMAP_MEMBER(respiration.channel),
            "its phase comes from the respiration channel where there is one, else from the images alone")
      .integer("device_channel", 0, 8, PERIMAP_MEMBER(respiration.device_channel),
               "input of the ECG device with respiration: bitalino 1 to 6, cyton 1 to 8, can 2; 0: none")
      .duration("shortest_period_s", s, 0.5, 60, PERIMAP_MEMBER(respiration.shortest_period), "no breath is shorter")
      .duration("longest_period_s", s, 0.5, 60, PERIMAP_MEMBER(respiration.longest_period), "no breath is longer")
      .number("displacement_deviation_mm", 0.1, 100, PERIMAP_MEMBER(respiration.displacement_deviation_mm),
              "displacement by breathing to reckon with until its phase is known, standard deviation of an axis");
  using Release = PipelineConfiguration::Release;
  const std::array<std::pair<std::string_view, Release>, 3> releases{
      {{"frame", Release::kFrame}, {"clock", Release::kClock}, {"both", Release::kBoth}}};
  Section("pipeline", keys)
      .choice("release", releases, PERIMAP_MEMBER(pipeline.release),
              "what releases surfaces: each camera frame, a fixed grid of the monotonic clock, or each its own stream")
      .number("clock_rate_hz", 1, 1000, PERIMAP_MEMBER(pipeline.clock_rate_hz),
              "of that grid; see dds.maximum_MB_per_s")
      .duration("latency_ms", ms, 1, 1000, PERIMAP_MEMBER(pipeline.latency),
                "a frame's release minus its capture; to the clock a frame that is not mapped by then is late")
      .duration("lead_ms", ms, 0, 1000, PERIMAP_MEMBER(pipeline.lead), "valid time of a surface minus its release")
      .duration("budget_ms", ms, 0.1, 1000, PERIMAP_MEMBER(pipeline.budget),
                "computing time kept free before the release; less than latency_ms")
      .flag("shedding", PERIMAP_MEMBER(pipeline.shedding),
            "while frames take longer than that, the least useful features are not looked for; never in lockstep")
      .integer("workers", 1, 64, PERIMAP_MEMBER(pipeline.workers), "worker threads")
      .duration("adoption_delay_ms", ms, 30, 4000, PERIMAP_MEMBER(pipeline.adoption_delay),
                "from the request of a batch start to the frame that adopts it; counted in frames at their rate")
      .former_frames("adoption_delay_frames", 1, 120, PERIMAP_MEMBER(pipeline.adoption_delay));
  Section("features", keys)
      .integer("maximum", 1, 1000, PERIMAP_MEMBER(features.maximum), "features followed at a time")
      .duration("detection_interval_ms", ms, 200, 30000, PERIMAP_MEMBER(features.detection_interval),
                "in which all of the picture is searched for new features once; a large one takes longer")
      .former_frames("detection_interval_frames", 6, 1000, PERIMAP_MEMBER(features.detection_interval))
      .number("minimum_distance_px", 1, 1000, PERIMAP_MEMBER(features.minimum_distance_px),
              "a new feature keeps this distance from all others, and at least 0.63 of what an even spread has");
}

void add_filter(std::vector<ConfigurationKey>& keys) {
  const std::array<std::pair<std::string_view, UpdateMethod>, 2> updates{
      {{"levenberg-marquardt", UpdateMethod::kLevenbergMarquardt}, {"gauss-newton", UpdateMethod::kGaussNewton}}};
  const std::array<std::pair<std::string_view, Precision>, 2> precisions{
      {{"double", Precision::kDouble}, {"single", Precision::kSingle}}};
  Section("estimation", keys)
      .integer("harmonics", 1, 12, PERIMAP_MEMBER(estimation.harmonics), "cardiac harmonics of each feature's motion")
      .choice("precision", precisions, PERIMAP_MEMBER(estimation.precision),
              "of the map's numbers; single: half the memory, and less computing")
      .integer("start_observations", 10, 96, PERIMAP_MEMBER(estimation.start_observations),
               "observations that the batch start of a feature takes")
      .numbers(
          "start_depths_mm", "1 to 8 rising numbers from 1 to 10000",
          [](const std::vector<double>& v, Configuration& configuration) {
            if (v.empty() || v.size() > 8) {
              return false;
            }
            for (std::size_t i = 0; i < v.size(); ++i) {
              if (!within(v[i], 1, 10000) || (i > 0 && v[i] <= v[i - 1])) {
                return false;
              }
            }
            configuration.estimation.start_depths_mm = v;
            return true;
          },
          [](const Configuration& configuration) { return configuration.estimation.start_depths_mm; },
          "depths from which the batch start tries")
      .number("pixel_deviation_px", 0.01, 100, PERIMAP_MEMBER(estimation.pixel_deviation_px),
              "standard deviation of a match, an axis")
      .choice("update", updates, PERIMAP_MEMBER(estimation.update),
              "how an update iterates; gauss-newton: as the paper")
      .number("step_factor", 0.01, 1, PERIMAP_MEMBER(estimation.step_factor),
              "share of a Gauss-Newton step that is taken")
      .integer("iterations", 1, 100, PERIMAP_MEMBER(estimation.iterations), "most iterations of one update")
      .number("tolerance", 0, 1, PERIMAP_MEMBER(estimation.tolerance),
              "an update has converged with a step this short, in standard deviations; 0: always all iterations")
      .number("gate_chi2", 0.1, 1000, PERIMAP_MEMBER(estimation.gate_chi2),
              "a match of higher cost at the optimum is refused; 23: 99.999 % of chi-square, 2 degrees")
      .number("prior_dc_deviation_mm", 0.1, 10000, PERIMAP_MEMBER(estimation.prior_dc_deviation_mm),
              "prior standard deviation of a feature's mean position")
      .number("prior_harmonic_deviation_mm", 0.01, 1000, PERIMAP_MEMBER(estimation.prior_harmonic_deviation_mm),
              "prior standard deviation of harmonic 1; harmonic k has this / k^2")
      .number("converged_deviation_mm", 0, 100, PERIMAP_MEMBER(estimation.converged_deviation_mm),
              "largest deviation over the cycle, in any direction, of a converged feature; 0: 1 mm");
}

bool is_socket_path(const std::string& text) {
  constexpr std::size_t kLongest = 107;  // of unix(7), less the final NUL
  return text.starts_with('/') && text.size() <= kLongest && text.find('\0') == std::string::npos;
}

// A scan that is gated by the ECG gives 10 to 40.
constexpr std::size_t kMostModelPhases = 64;

bool is_group_name(const std::string& text) {
  return !text.empty() && text.size() <= 64 && text.find_first_of(std::string_view("\0:/ \n", 5)) == std::string::npos;
}

bool is_absolute_path(const std::string& text) { return text.starts_with('/') && text.find('\0') == std::string::npos; }

void add_model(std::vector<ConfigurationKey>& keys) {
  const std::array<std::pair<std::string_view, double>, 2> units{{{"mm", 1.0}, {"m", 1000.0}}};
  Section("model", keys)
      .file("file", PERIMAP_MEMBER(model.file),
            "a surface of the organ that was imaged before (STL, PLY, OBJ, VTK), in the frame I of the registration: "
            "the published mesh has its vertices, set in motion; none: the mesh is laid through the features")
      .choice("unit", units, PERIMAP_MEMBER(model.unit_mm), "of its coordinates")
      .number("phase", 0, 1, PERIMAP_MEMBER(model.phase),
              "when it was imaged, as a share of the time from one R peak to the next")
      .number("shape_mm", 0.05, 20, PERIMAP_MEMBER(model.shape_mm),
              "what its shape may be off by along its normals, standard deviation")
      .number("registration_mm", 0.05, 20, PERIMAP_MEMBER(model.registration_mm),
              "what its place at the organ may be off by in each direction, standard deviation, as `perimap refine` "
              "tells it")
      .files(
          "other_files", kMostModelPhases, PERIMAP_MEMBER(model.other_files),
          "the same mesh at other phases, vertex for vertex, at least two: how the model moves by itself is then what "
          "the surface supposes, as far as features do so too")
      .numbers(
          "other_phases", fmt::format("up to {} numbers from 0 to below 1", kMostModelPhases),
          [](const std::vector<double>& phases, Configuration& configuration) {
            const bool good = phases.size() <= kMostModelPhases &&
                              std::all_of(phases.begin(), phases.end(), [](double p) { return p >= 0.0 && p < 1.0; });
            if (good) configuration.model.other_phases = phases;
            return good;
          },
          [](const Configuration& configuration) { return configuration.model.other_phases; },
          "of model.other_files, each as model.phase");
}

void add_running(std::vector<ConfigurationKey>& keys) {
  const auto ms = std::chrono::milliseconds(1);
  const auto s = std::chrono::seconds(1);
  Section("use", keys)
      .number("display_mm", 0.1, 100, PERIMAP_MEMBER(use.display_mm),
              "a surface may be shown where 95 % of errors are within so much; each surface says whether they are")
      .number("measure_mm", 0.1, 100, PERIMAP_MEMBER(use.measure_mm), "likewise, to measure in it")
      .number("contact_mm", 0.1, 100, PERIMAP_MEMBER(use.contact_mm), "likewise, to act in contact with it");
  add_model(keys);
  Section("realtime", keys)
      .integer("priority", 0, 98, PERIMAP_MEMBER(realtime.priority), "SCHED_FIFO priority; 0: not requested")
      .flag("lock_memory", PERIMAP_MEMBER(realtime.lock_memory), "keeps all memory in RAM")
      .add(
          "cpus", "processors that real-time threads may use; empty: any", "up to 64 integers from 0 to 1023",
          [](const ConfigurationValue& value, Configuration& configuration) {
            const auto* cpus = std::get_if<std::vector<std::int64_t>>(&value);
            if (cpus == nullptr || cpus->size() > 64) {
              return false;
            }
            std::vector<int> accepted;
            for (const std::int64_t cpu : *cpus) {
              if (cpu < 0 || cpu > 1023) {
                return false;
              }
              accepted.push_back(static_cast<int>(cpu));
            }
            configuration.realtime.cpus = std::move(accepted);
            return true;
          },
          [](const Configuration& configuration) -> std::optional<ConfigurationValue> {
            const std::vector<int>& cpus = configuration.realtime.cpus;
            return std::vector<std::int64_t>(cpus.begin(), cpus.end());
          });
  // Domain 230 is the last whose ports fit into 16 bits (DDSI-RTPS 2.2, 9.6.1.1).
  Section("dds", keys)
      .flag("enabled", PERIMAP_MEMBER(dds.enabled), "publishes over DDS")
      .integer("domain", 0, 230, PERIMAP_MEMBER(dds.domain), "domain of the DDS participant")
      .duration("surface_deadline_ms", ms, 0, 60000, PERIMAP_MEMBER(dds.surface_deadline),
                "longest time between two surfaces that the writer promises; 0: no promise")
      .duration("surface_lifespan_ms", ms, 0, 60000, PERIMAP_MEMBER(dds.surface_lifespan),
                "an undelivered surface is dropped after this; 0: never")
      .duration("surface_model_interval_ms", ms, 1, 60000, PERIMAP_MEMBER(dds.surface_model_interval),
                "from one surface_model to the next")
      .number(
          "maximum_MB_per_s", 0.1, 10000, PERIMAP_MEMBER(dds.maximum_MB_per_s),
          "of surfaces and surface models with features.maximum features, to one reader (or any number by multicast); "
          "rates that come to more are refused")
      .folder("security", PERIMAP_MEMBER(dds.security),
              "keys for DDS Security, as `perimap keys issue` makes them, from this file's folder; none: whoever is on "
              "the network can listen, and publish under this name");
  Section("recording", keys)
      .flag("record", PERIMAP_MEMBER(recording.record),
            "what the devices give is recorded as it came, to perimap-DATE-TIME.mcap")
      .text("folder", 4096, PERIMAP_MEMBER(recording.folder), "where to, from this file's folder")
      .integer("memory_MB", 1, 65536, PERIMAP_MEMBER(recording.memory_MB), "for frames on their way to the disk")
      .optional_text("group", "the name of a group of this machine", is_group_name, PERIMAP_MEMBER(recording.group),
                     "may read the recordings; none: their owner alone");
  Section("status", keys)
      .duration("interval_s", s, 0.1, 3600, PERIMAP_MEMBER(status.interval), "from one status to the next");
  using Level = LogConfiguration::Level;
  const std::array<std::pair<std::string_view, Level>, 5> levels{{{"trace", Level::kTrace},
                                                                  {"debug", Level::kDebug},
                                                                  {"info", Level::kInfo},
                                                                  {"warning", Level::kWarning},
                                                                  {"error", Level::kError}}};
  Section("log", keys).choice("level", levels, PERIMAP_MEMBER(log.level), "least severity that is logged");
  Section("control", keys)
      .optional_text("socket", "an absolute path of at most 107 bytes", is_socket_path, PERIMAP_MEMBER(control.socket),
                     "where `perimap ctl` reaches perimapd; none: nowhere, or, as a service, in its runtime directory");
  Section("checkpoint", keys)
      .optional_text(
          "file", "an absolute path", is_absolute_path, PERIMAP_MEMBER(checkpoint.file),
          "where map and rhythm are kept for a restart after a crash; none: nowhere, or, as a service, in its "
          "state directory")
      .duration("interval_s", s, 0.1, 3600, PERIMAP_MEMBER(checkpoint.interval), "from one checkpoint to the next")
      .duration("maximum_age_s", s, 0, 86400, PERIMAP_MEMBER(checkpoint.maximum_age),
                "an older checkpoint is not gone on with");
  Section("blackbox", keys)
      .optional_text("folder", "an absolute path", is_absolute_path, PERIMAP_MEMBER(blackbox.folder),
                     "where what is published and commanded is kept for `perimap verify-log`; none: nowhere, or, as a "
                     "service, in its state directory")
      .duration("ring_minutes", std::chrono::minutes(1), 1, 1440, PERIMAP_MEMBER(blackbox.ring),
                "so much of everything is kept; of what lies around an event more")
      .duration("keep_days", std::chrono::hours(24), 1, 3650, PERIMAP_MEMBER(blackbox.keep),
                "nothing is kept longer, events neither")
      .integer("maximum_MB", 64, 1000000, PERIMAP_MEMBER(blackbox.maximum_MB),
               "of all of it; what no event holds goes first");
}

#undef PERIMAP_MEMBER

}  // namespace

std::span<const ConfigurationKey> configuration_keys() {
  static const std::vector<ConfigurationKey> keys = [] {
    std::vector<ConfigurationKey> all;
    add_version(all);
    add_sources(all);
    add_tracker(all);
    add_ecg(all);
    add_estimation(all);
    add_filter(all);
    add_running(all);
    return all;
  }();
  return keys;
}

}  // namespace perimap
