#include "daemon/standins/options/simulation_options.hpp"

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <numbers>

#include "daemon/command_line/choice.hpp"
#include "drivers/standins/procedure/procedure_draw.hpp"
#include "drivers/standins/procedure/procedure_text.hpp"
#include "drivers/standins/simulator/ecg_record.hpp"
#include "drivers/standins/trace/hindsight.hpp"
#include "drivers/standins/trace/motion_trace.hpp"

namespace perimap {
namespace {

constexpr double kRadians_per_degree = std::numbers::pi / 180.0;

// "BEGIN:LENGTH", s.
Expected<SimulationSettings::Stretch> parse_stretch(const char* what, const std::string& text) {
  const char* end = text.data() + text.size();
  double begin_s = 0.0;
  double length_s = 0.0;
  const auto begin = std::from_chars(text.data(), end, begin_s);
  if (begin.ec == std::errc{} && begin.ptr != end && *begin.ptr == ':') {
    const auto length = std::from_chars(begin.ptr + 1, end, length_s);
    const bool sound = begin_s >= 0.0 && length_s > 0.0 && begin_s + length_s < 1e6;
    if (length.ec == std::errc{} && length.ptr == end && sound)
      return SimulationSettings::Stretch{from_seconds(begin_s), from_seconds(length_s)};
  }
  return fail(fmt::format("{}: expected BEGIN:LENGTH in seconds, such as 30:10, found '{}'", what, text));
}

Expected<void> parse_stretches(const char* what, const std::vector<std::string>& texts,
                               std::vector<SimulationSettings::Stretch>& stretches) {
  for (const std::string& text : texts) {
    const auto stretch = parse_stretch(what, text);
    if (!stretch) return tl::unexpected(stretch.error());
    stretches.push_back(*stretch);
  }
  return {};
}

Expected<void> parse_size(const std::string& text, SimulationSettings& settings) {
  const char* end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, settings.width);
  if (width.ec == std::errc{} && width.ptr != end && *width.ptr == 'x') {
    const auto height = std::from_chars(width.ptr + 1, end, settings.height);
    if (height.ec == std::errc{} && height.ptr == end) return {};
  }
  return fail(fmt::format("size: expected WIDTHxHEIGHT in pixels, such as 640x480, found '{}'", text));
}

}  // namespace

Expected<Procedure> SimulationOptions::procedure(const SimulationSettings& settings) const {
  constexpr std::string_view kDraw = "draw:";
  if (!procedure_.starts_with(kDraw)) return load_procedure(procedure_);
  ProcedureDrawing drawing;
  const char* const begin = procedure_.data() + kDraw.size();
  const char* const end = procedure_.data() + procedure_.size();
  const auto seed = std::from_chars(begin, end, drawing.seed);
  if (seed.ec != std::errc{} || seed.ptr != end) {
    return fail(fmt::format("procedure: expected draw:SEED, such as draw:1, found '{}'", procedure_));
  }
  drawing.duration = settings.duration;
  drawing.electromagnetic = electromagnetic_;
  drawing.turns_scope = settings.held.has_value();
  if (settings.held) drawing.held_deg = settings.held->notch_rad / kRadians_per_degree;
  return draw_procedure(drawing);
}

Option* SimulationOptions::add_to(Command& command) {
  command
      .add_option("--seed", settings_.seed, "Chooses texture, path, noise and part of the ECG; same seed, same bytes")
      ->capture_default_str();
  command
      .add_option("--setup-seed", settings_.setup_seed,
                  "Draws another lens, place of the sensor on the scope and delay of the tracker; 0: the usual ones")
      ->capture_default_str();
  command.add_option("--duration", duration_s_, "Length, s")->capture_default_str();
  command.add_option("--size", size_, "Image size WIDTHxHEIGHT, px")->capture_default_str();
  command.add_option("--fps", settings_.frames_per_s, "Camera frame rate, Hz")->capture_default_str();
  command
      .add_option("--ecg", settings_.ecg_record,
                  "ECG record that drives the heart: " + ecg_record_names() +
                      " (100 nearly regular, 105 noisy, 106 and 119 bigeminy, 123 slow, 03700181 fast)")
      ->capture_default_str();
  command.add_option("--ecg-start", ecg_start_s_, "Where in the record to start, s [chosen by the seed]");
  command.add_option("--ecg-off", ecg_off_, "The electrode is off, BEGIN:LENGTH in s; may be repeated");
  const std::map<std::string, MotionLaw> laws{
      {"linear", MotionLaw::kLinear}, {"warped", MotionLaw::kWarped}, {"time-locked", MotionLaw::kTimeLocked}};
  command
      .add_option_function<std::string>(
          "--motion", [this, laws](const std::string& name) { settings_.law = laws.at(name); },
          "How motion runs between R peaks: linear, warped (systole keeps its length), time-locked (diastasis "
          "stretches) [linear]")
      ->check(OneOf({"linear", "warped", "time-locked"}));
  command.add_option(
      "--motion-trace", motion_trace_,
      "A recorded heart moves the surface in the place of --motion, and its beats are in the ECG: a CSV "
      "with a time in seconds and x, y, z in mm of each point, as a camera has them; it begins anew where "
      "it ends");
  command.add_option("--respiration", settings_.respiration_mm, "Breathing displacement at full inspiration, mm")
      ->capture_default_str();
  command.add_flag("--respiration-channel", settings_.respiration_channel,
                   "There is a respiration channel, as a ventilator or a monitor has one");
  command.add_option("--respiration-period", respiration_period_s_, "Breathing period, s")->capture_default_str();
  command
      .add_option("--scope-sweep", settings_.scope_sweep,
                  "How far from its target the scope looks, times the usual: at 5 what lies off it leaves the view")
      ->capture_default_str();
  add_choice(command, "--look", settings_.look,
             {{name_of(Look::kRendered), Look::kRendered}, {name_of(Look::kTissue), Look::kTissue}},
             "What the heart looks like: rendered (strong texture, easy to follow), tissue (weak and uneven texture, "
             "wet highlights and changing light as in footage of tissue) [rendered]");
  command.add_option("--exposure", settings_.exposure_share, "Motion blur: exposure as a share of the frame period")
      ->capture_default_str();
  command.add_flag("--instrument", settings_.instrument, "An instrument comes into view for 3 s every 6 s");
  command
      .add_option("--smoke", settings_.smoke,
                  "Clouds that come for 5 s every 8 s: optical depth of the thickest, 1 leaves 37 % of the contrast")
      ->capture_default_str();
  command.add_option("--glints", settings_.glints, "Highlights that wander over the tissue, besides its own")
      ->capture_default_str();
  Option* noise =
      command.add_option("--tracker-noise", tracker_noise_mm_, "Tracker position noise, RMS of the 3-D norm, mm")
          ->check(Range(0.0, 100.0))
          ->capture_default_str();
  command
      .add_option("--tracker-rotation-noise", tracker_rotation_noise_deg_,
                  "Tracker rotation noise, RMS of the 3-D norm, degrees [0.5, or 0 without position noise]")
      ->check(Range(0.0, 45.0));
  command
      .add_option("--tracker-correlation", tracker_correlation_s_,
                  "Time in which the tracker's error falls to 1/e of what it was, s; 0: it is new at each reading")
      ->capture_default_str();
  command.add_option("--tracker-rate", settings_.tracker_rate_hz, "Tracker readings, Hz")->capture_default_str();
  command
      .add_option("--tracker-dropouts", settings_.tracker_dropouts_per_min,
                  "Times a minute that the tracker loses the tool, for 50 to 300 ms")
      ->capture_default_str();
  command.add_option("--tracker-stuck", tracker_stuck_,
                     "The tracker gives its last reading again and again, BEGIN:LENGTH in s; may be repeated");
  command.add_option("--camera-stuck", camera_stuck_, "Likewise the camera its last picture");
  command.add_option("--camera-loop", camera_loops_, "Likewise the camera the pictures of its last two seconds");
  command.add_option("--ecg-loop", ecg_loops_, "Likewise the ECG its last second");
  command.add_flag("--patient-tool", settings_.patient_tool,
                   "A tool that is fixed to the organ is tracked too, and tells whether that has been moved");
  command
      .add_option("--camera-repeats", settings_.camera_repeats,
                  "Each picture comes so often, as of a camera that is slower than its stamps say")
      ->capture_default_str();
  return noise;
}

void SimulationOptions::add_procedure_to(Command& command) {
  command.add_option("--procedure", procedure_,
                     "What happens meanwhile: a script of events (TOML), or draw:SEED for one that is drawn over the "
                     "whole length; the session may be an hour long then");
  command.add_flag("--electromagnetic", electromagnetic_,
                   "With --procedure draw:SEED: metal and electrosurgery disturb the tracker");
}

Expected<BenchSettings> SimulationOptions::bench(BenchAct act) const {
  SimulationSettings size;
  if (const auto good = parse_size(size_, size); !good) return tl::unexpected(good.error());
  BenchSettings bench;
  bench.act = act;
  bench.seed = settings_.seed;
  bench.setup_seed = settings_.setup_seed;
  bench.width = size.width;
  bench.height = size.height;
  bench.duration = from_seconds(duration_s_);
  bench.frames_per_s = settings_.frames_per_s;
  bench.tracker_rate_hz = settings_.tracker_rate_hz;
  bench.tracker_correlation = from_seconds(tracker_correlation_s_);
  return bench;
}

Expected<SimulationSettings> SimulationOptions::settings() const {
  SimulationSettings settings = settings_;
  if (const auto size = parse_size(size_, settings); !size) return tl::unexpected(size.error());
  settings.duration = from_seconds(duration_s_);
  settings.respiration_period = from_seconds(respiration_period_s_);
  settings.tracker_correlation = from_seconds(tracker_correlation_s_);
  for (const auto& parsed : {parse_stretches("ECG off", ecg_off_, settings.ecg_off),
                             parse_stretches("tracker stuck", tracker_stuck_, settings.tracker_stuck),
                             parse_stretches("camera stuck", camera_stuck_, settings.camera_stuck),
                             parse_stretches("camera loop", camera_loops_, settings.camera_loops),
                             parse_stretches("ECG loop", ecg_loops_, settings.ecg_loops)}) {
    if (!parsed) return tl::unexpected(parsed.error());
  }
  if (!motion_trace_.empty()) {
    auto motion = read_motion_trace(motion_trace_);
    if (!motion) return tl::unexpected(motion.error());
    auto hindsight = in_hindsight(*motion);
    if (!hindsight) return tl::unexpected(hindsight.error());
    settings.trace = std::make_shared<const HeartTrace>(HeartTrace{*std::move(motion), *std::move(hindsight)});
  }
  if (ecg_start_s_) settings.ecg_start = from_seconds(*ecg_start_s_);
  return settings;
}

TrackerNoise SimulationOptions::noise(double position_mm) const {
  constexpr double kUsual_deg = 0.5;
  const double rotation_deg = tracker_rotation_noise_deg_.value_or(position_mm > 0.0 ? kUsual_deg : 0.0);
  return {position_mm, rotation_deg * kRadians_per_degree};
}

std::optional<Duration> SimulationOptions::breath() const {
  if (!settings_.respiration_channel) return std::nullopt;
  return from_seconds(respiration_period_s_);
}

}  // namespace perimap
