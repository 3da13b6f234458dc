#include "drivers/standins/simulator/simulation_settings.hpp"

#include <fmt/format.h>

#include <cmath>

namespace perimap {
namespace {

// A delay that fell faster than this would bring data of a later instant first.
template <class Kind>
Expected<void> check_drift(const Procedure& procedure) {
  constexpr double kFastest_ms_per_s = 500.0;
  double ms = 0.0;
  for (const ProcedureEvent& event : procedure.events) {
    const auto* delay = std::get_if<Kind>(&event.what);
    if (delay == nullptr) continue;
    if (std::abs(delay->to_ms - ms) > kFastest_ms_per_s * to_seconds(event.length)) {
      return fail(fmt::format("{} at {} s: expected at most {} ms a second, got {} ms in {} s", kind_of(event.what),
                              to_seconds(event.at), kFastest_ms_per_s, delay->to_ms - ms, to_seconds(event.length)));
    }
    ms = delay->to_ms;
  }
  return {};
}

}  // namespace

Expected<void> check(const SimulationSettings& s) {
  const auto outside = [](const char* what, double value, double low, double high, const char* unit) -> Expected<void> {
    if (value >= low && value <= high) return {};
    return fail(fmt::format("{}: {} is outside {} to {} {}", what, value, low, high, unit));
  };
  if (s.width % 2 != 0 || s.height % 2 != 0)
    return fail(fmt::format("size: {}x{} is not even in both directions", s.width, s.height));
  if (s.trace && (s.respiration_mm > 0.0 || s.respiration_channel)) {
    return fail("motion trace: expected no respiration beside it, it has its own");
  }
  if (s.trace && s.ecg_start) return fail("motion trace: expected no ECG start, its ECG is made");
  if (s.second_sensor && !s.held) return fail("second sensor: expected a scope that is turned by some angle");
  if (s.turn && !s.held) return fail("turn: expected a field stop, whose notch tells of it");
  if (s.procedure.has<ScopeTurnedInHead>()) {
    if (!s.held) return fail("scope-turn: expected a field stop, whose notch tells of it");
    if (s.turn) return fail("turn: expected none beside the procedure's, scope-turn");
  }
  for (const Expected<void>& drifts : {check_drift<CameraDelay>(s.procedure), check_drift<TrackerDelay>(s.procedure)}) {
    if (!drifts) return drifts;
  }
  for (const ProcedureEvent& event : s.procedure.events) {
    if (event.at < s.duration) continue;
    return fail(fmt::format("procedure: {} begins at {} s, expected before the end at {} s", kind_of(event.what),
                            to_seconds(event.at), to_seconds(s.duration)));
  }
  const double longest_s = s.procedure.empty() ? 1700.0 : 7200.0;
  if (s.turn && (s.turn->at < Duration(0) || s.turn->length <= Duration(0))) {
    return fail("turn: expected a time since the start, and a length above 0");
  }
  for (const Expected<void>& result :
       {outside("duration", to_seconds(s.duration), 1.0, longest_s, "s"), outside("width", s.width, 64, 4096, "px"),
        outside("height", s.height, 64, 4096, "px"), outside("fps", s.frames_per_s, 1.0, 1000.0, "Hz"),
        outside("respiration", s.respiration_mm, 0.0, 50.0, "mm"),
        outside("respiration period", to_seconds(s.respiration_period), 0.5, 60.0, "s"),
        outside("tracker rate", s.tracker_rate_hz, 1.0, 1000.0, "Hz"),
        outside("tracker correlation", to_seconds(s.tracker_correlation), 0.0, 1000.0, "s"),
        outside("tracker dropouts", s.tracker_dropouts_per_min, 0.0, 60.0, "a minute"),
        outside("camera repeats", s.camera_repeats, 1, 100, "times"),
        outside("scope sweep", s.scope_sweep, 0.0, 20.0, "times the usual"),
        outside("exposure", s.exposure_share, 0.0, 1.0, "of the frame period"),
        outside("glints", s.glints, 0, 1000, ""), outside("smoke", s.smoke, 0.0, 10.0, "")})
    if (!result) return result;
  return {};
}

}  // namespace perimap
