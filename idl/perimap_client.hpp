// For navigation software: where the surface is at an instant of its own choosing, from the newest
// perimap::SurfaceModel.
//
//   perimap::client::PredictedSurface surface;   // kept: its memory is used again
//   if (!perimap::client::predict(*model, display_time_ns, now_ns, {}, surface)) show(describe(surface));
//
// Needs C++17, the C types that idlc makes of perimap.idl, and nothing else. Lengths are millimetres, angles radians,
// times nanoseconds of CLOCK_MONOTONIC on perimapd's host; elsewhere monotonic_of_utc() gives them. All functions are
// pure: they keep nothing, call nothing, and may be used on any thread.
//
// Positions and velocities are those that perimapd itself would publish for that instant, knowing what it knew when it
// made the model: the same but for the rounding of the wire's times to 1 ns, which is 1e-6 mm for each metre a second.
// A covariance is the bound that perimapd gives when a frame is missing: the largest deviation over the cycle, and what
// the deviations of the phases at that instant make of the motion.
#pragma once

#include <perimap.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace perimap::client {

// Why there is no prediction. Nothing is ever extrapolated beyond what the model says it is good for.
enum class Refusal : std::uint8_t {
  kNone,
  kStale,           // now is past the model's valid_until_ns: perimapd has gone, or is not heard
  kBeforeValidity,  // the instant asked for lies before valid_from_ns
  kBeyondValidity,  // or after valid_until_ns
  kInvalid,         // perimapd says so; PredictedSurface::reason
  kDegraded,        // likewise, and the caller does not accept that
  kMalformed        // numbers that perimapd does not send, or a law that this header does not know
};

struct Acceptance {
  bool degraded = false;  // usable with care: take it too
};

struct PredictedFeature {
  std::uint32_t id = 0;
  perimap_FeatureState state = perimap_FEATURE_INVALID;  // use FEATURE_CONVERGED, others only on purpose
  perimap_FeatureReason reason = perimap_FEATURE_REASON_NONE;
  std::array<double, 3> position_W_mm{};
  std::array<double, 3> velocity_W_mm_per_s{};
  std::array<double, 6> covariance_W_mm2{};  // of the position: xx xy xz yy yz zz
  std::int64_t last_observed_time_ns = 0;
};

struct PredictedSurface {
  Refusal refusal = Refusal::kMalformed;
  perimap_SurfaceState state = perimap_SURFACE_INVALID;  // at time_ns
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
  std::int64_t time_ns = 0;
  double cardiac_phase_rad = 0.0;
  double cardiac_phase_deviation_rad = 0.0;
  double cardiac_phase_rate_rad_per_s = 0.0;
  std::vector<PredictedFeature> features;  // in order of id; empty when refused
};

namespace detail {

constexpr double kTwoPi = 6.283185307179586476925;
constexpr std::uint32_t kMostHarmonics = 64;  // of each kind; perimapd has at most 12 cardiac and 2 respiratory
constexpr std::size_t kMostBasis = 1 + 4 * kMostHarmonics;

inline double seconds(std::int64_t ns) noexcept { return 1e-9 * static_cast<double>(ns); }

struct Phase {
  double phase_rad = 0.0;
  double rate_rad_per_s = 0.0;
  double deviation_rad = 0.0;
};

// The phase runs evenly through up to three parts of a cycle. `bound` and `previous` are w and p of perimap.idl at a
// part's beginning and end.
struct Part {
  double begin_s, end_s, begin_rad, end_rad, begin_bound, end_bound, begin_previous, end_previous;
};

// Under one law. `bound` and `previous` are w and p of perimap.idl.
struct LawPhase {
  double phase_rad = 0.0;
  double rate_rad_per_s = 0.0;
  double bound = 0.0;
  double previous = 0.0;
};

// False: the law is not known, or its numbers make no cycle.
inline bool law_phase_at(const perimap_PhaseClock& clock, const perimap_CardiacCycle& cycle, perimap_PhaseLaw law,
                         double s, LawPhase& phase) noexcept {
  const double length = seconds(cycle.length_ns);
  std::array<Part, 3> parts{};
  std::size_t count = 1;
  switch (law) {
    case perimap_PHASE_LAW_LINEAR:
      parts[0] = {0.0, length, 0.0, kTwoPi, 0.0, 1.0, 0.0, 0.0};
      break;
    case perimap_PHASE_LAW_WARPED: {
      const double systole = seconds(cycle.systole_ns);
      const double systole_rad = kTwoPi * clock.systole_fraction;
      const double slope = cycle.systole_slope;
      parts[0] = {0.0, systole, 0.0, systole_rad, 0.0, 0.0, 0.0, slope};
      parts[1] = {systole, length, systole_rad, kTwoPi, 0.0, 1.0, slope, 0.0};
      count = 2;
      break;
    }
    case perimap_PHASE_LAW_TIME_LOCKED: {
      const double systole = seconds(cycle.locked_systole_ns);
      const double filling = length - seconds(cycle.locked_filling_ns);
      const double systole_rad = clock.locked_systole_phase_rad;
      const double filling_rad = clock.locked_filling_phase_rad;
      parts[0] = {0.0, systole, 0.0, systole_rad, 0.0, 0.0, 0.0, 0.0};
      parts[1] = {systole, filling, systole_rad, filling_rad, 0.0, 1.0, 0.0, 0.0};
      parts[2] = {filling, length, filling_rad, kTwoPi, 1.0, 1.0, 0.0, 0.0};
      count = 3;
      break;
    }
    default:
      return false;
  }
  std::size_t i = 0;
  while (i + 1 < count && s >= parts[i].end_s) ++i;
  const Part& part = parts[i];
  if (!(part.end_s > part.begin_s) || !(part.end_rad >= part.begin_rad)) return false;
  const double share = (s - part.begin_s) / (part.end_s - part.begin_s);
  phase.rate_rad_per_s = (part.end_rad - part.begin_rad) / (part.end_s - part.begin_s);
  phase.phase_rad = part.begin_rad + share * (part.end_rad - part.begin_rad);
  phase.previous = part.begin_previous + share * (part.end_previous - part.begin_previous);
  phase.bound = cycle.stretches ? s / length : part.begin_bound + share * (part.end_bound - part.begin_bound);
  return true;
}

// False as above.
inline bool phase_at(const perimap_PhaseClock& clock, const perimap_CardiacCycle& cycle, std::int64_t t_ns,
                     Phase& phase) noexcept {
  const double s = seconds(t_ns - cycle.begin_time_ns);
  LawPhase told;
  if (!law_phase_at(clock, cycle, clock.law, s, told)) return false;
  double law_variance_rad2 = 0.0;
  constexpr std::array<perimap_PhaseLaw, 3> kLaws{perimap_PHASE_LAW_LINEAR, perimap_PHASE_LAW_WARPED,
                                                  perimap_PHASE_LAW_TIME_LOCKED};
  for (std::size_t i = 0; i < kLaws.size(); ++i) {
    const double probability = clock.law_probabilities[i];
    if (probability == 0.0) continue;
    LawPhase other;
    if (!law_phase_at(clock, cycle, kLaws[i], s, other)) return false;
    const double difference = other.phase_rad - told.phase_rad;
    law_variance_rad2 += probability * difference * difference;
  }
  phase.phase_rad = told.phase_rad;
  phase.rate_rad_per_s = told.rate_rad_per_s;
  const double begin = seconds(cycle.begin_deviation_ns);
  const double end = told.bound * seconds(cycle.length_deviation_ns);
  const double irregular = cycle.measured ? told.bound * seconds(cycle.irregularity_ns) : 0.0;
  const double begin_bound = cycle.measured ? 1.0 - told.bound : 1.0;
  const double previous = seconds(cycle.previous_length_deviation_ns);
  const double shared = std::min(begin, previous);
  const double deviation_s =
      std::sqrt(begin_bound * begin_bound * begin * begin + 2.0 * begin_bound * told.previous * shared * shared +
                told.previous * told.previous * previous * previous + end * end + irregular * irregular);
  phase.deviation_rad = std::hypot(phase.rate_rad_per_s * deviation_s, std::sqrt(law_variance_rad2));
  return std::isfinite(phase.phase_rad) && std::isfinite(phase.deviation_rad);
}

// Null: none holds t.
inline const perimap_CardiacCycle* cycle_at(const perimap_SurfaceModel& model, std::int64_t t_ns) noexcept {
  for (std::uint32_t i = 0; i < model.cardiac_cycles._length; ++i) {
    const perimap_CardiacCycle& cycle = model.cardiac_cycles._buffer[i];
    // Unsigned: whatever the numbers are, the difference of two instants in order is one.
    const std::uint64_t since = static_cast<std::uint64_t>(t_ns) - static_cast<std::uint64_t>(cycle.begin_time_ns);
    if (t_ns >= cycle.begin_time_ns && cycle.length_ns > 0 && since < static_cast<std::uint64_t>(cycle.length_ns)) {
      return &cycle;
    }
  }
  return nullptr;
}

// What is multiplied with one axis' coefficients: DC, cos k phi, -sin k phi, and the same of psi. Its derivative by one
// of the phases is had with `rate`.
struct Basis {
  std::array<double, kMostBasis> values{};
  std::size_t size = 0;

  void append(std::uint32_t harmonics, double phase_rad) noexcept {
    for (std::uint32_t k = 1; k <= harmonics; ++k) {
      values[size + k - 1] = std::cos(k * phase_rad);
      values[size + harmonics + k - 1] = -std::sin(k * phase_rad);
    }
    size += std::size_t{2} * harmonics;
  }
  void append_rate(std::uint32_t harmonics, double phase_rad) noexcept {
    for (std::uint32_t k = 1; k <= harmonics; ++k) {
      values[size + k - 1] = -1.0 * k * std::sin(k * phase_rad);
      values[size + harmonics + k - 1] = -1.0 * k * std::cos(k * phase_rad);
    }
    size += std::size_t{2} * harmonics;
  }
  void append_nothing(std::uint32_t harmonics) noexcept { size += std::size_t{2} * harmonics; }

  [[nodiscard]] std::array<double, 3> times(const double* coefficients) const noexcept {
    std::array<double, 3> sum{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < size; ++i) sum[axis] += coefficients[axis * size + i] * values[i];
    }
    return sum;
  }
};

// The bases that a whole surface has in common.
struct Bases {
  Basis position, by_cardiac, by_respiratory, earlier, later;
  double cardiac_rate = 0.0, respiratory_rate = 0.0, respiratory_variance_mm2 = 0.0;
};

inline Bases bases_at(const perimap_SurfaceModel& model, const Phase& phase, std::int64_t t_ns) noexcept {
  const std::uint32_t H = model.cardiac_harmonics;
  const std::uint32_t H_r = model.respiratory_harmonics;
  const perimap_RespiratoryClock& breath = model.respiratory_clock;
  const bool breathes = breath.state == perimap_RESPIRATION_LOCKED && breath.length_ns > 0;
  const double psi =
      breathes ? kTwoPi * static_cast<double>(t_ns - breath.anchor_time_ns) / static_cast<double>(breath.length_ns)
               : 0.0;
  Bases bases;
  for (Basis* basis : {&bases.position, &bases.earlier, &bases.later}) {
    basis->values[0] = 1.0;
    basis->size = 1;
  }
  bases.by_cardiac.size = bases.by_respiratory.size = 1;
  // Half a cycle is as wrong as a phase can be.
  const double deviation = std::min(phase.deviation_rad, 0.5 * kTwoPi);
  bases.position.append(H, phase.phase_rad);
  bases.earlier.append(H, phase.phase_rad - deviation);
  bases.later.append(H, phase.phase_rad + deviation);
  bases.by_cardiac.append_rate(H, phase.phase_rad);
  bases.by_respiratory.append_nothing(H);
  bases.by_cardiac.append_nothing(H_r);
  bases.cardiac_rate = phase.rate_rad_per_s;
  double deviation_mm = breath.deviation_mm;
  // Unless its phase is known, breathing is left out: the values stay zero.
  if (!breathes) {
    for (Basis* basis : {&bases.position, &bases.by_respiratory, &bases.earlier, &bases.later})
      basis->append_nothing(H_r);
  } else {
    for (Basis* basis : {&bases.position, &bases.earlier, &bases.later}) basis->append(H_r, psi);
    bases.by_respiratory.append_rate(H_r, psi);
    bases.respiratory_rate = kTwoPi / seconds(breath.length_ns);
    const double dt = seconds(t_ns - model.time_ns);
    const double variance = breath.phase_variance_rad2 + dt * (2.0 * breath.phase_rate_covariance_rad2_per_s +
                                                               dt * breath.rate_variance_rad2_per_s2);
    deviation_mm = breath.slope_mm_per_rad * std::sqrt(std::max(variance, 0.0));
  }
  bases.respiratory_variance_mm2 = deviation_mm * deviation_mm;
  return bases;
}

// False: a number is none.
inline bool predict_feature(const perimap_ModelFeature& feature, const Bases& bases, PredictedFeature& out) noexcept {
  const double* x = feature.coefficients_W_mm._buffer;
  out.id = feature.id;
  out.state = feature.state;
  out.reason = feature.reason;
  out.last_observed_time_ns = feature.last_observed_time_ns;
  out.position_W_mm = bases.position.times(x);
  const auto by_cardiac = bases.by_cardiac.times(x);
  const auto by_respiratory = bases.by_respiratory.times(x);
  const auto earlier = bases.earlier.times(x);
  const auto later = bases.later.times(x);
  const double of_map_and_breath =
      feature.largest_deviation_mm * feature.largest_deviation_mm + bases.respiratory_variance_mm2;
  bool finite = std::isfinite(of_map_and_breath);
  std::size_t element = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    out.velocity_W_mm_per_s[i] = bases.cardiac_rate * by_cardiac[i] + bases.respiratory_rate * by_respiratory[i];
    finite = finite && std::isfinite(out.position_W_mm[i]) && std::isfinite(out.velocity_W_mm_per_s[i]);
    for (std::size_t j = i; j < 3; ++j) {
      const double before = (earlier[i] - out.position_W_mm[i]) * (earlier[j] - out.position_W_mm[j]);
      const double after = (later[i] - out.position_W_mm[i]) * (later[j] - out.position_W_mm[j]);
      out.covariance_W_mm2[element++] = 0.5 * (before + after) + (i == j ? of_map_and_breath : 0.0);
    }
  }
  return finite;
}

inline bool well_formed(const perimap_SurfaceModel& model) noexcept {
  if (model.cardiac_harmonics > kMostHarmonics || model.respiratory_harmonics > kMostHarmonics) return false;
  const std::uint32_t size = 3 * (1 + 2 * (model.cardiac_harmonics + model.respiratory_harmonics));
  for (std::uint32_t i = 0; i < model.features._length; ++i) {
    if (model.features._buffer[i].coefficients_W_mm._length != size) return false;
  }
  return true;
}

inline bool predict_features(const perimap_SurfaceModel& model, std::int64_t t_ns, PredictedSurface& out) {
  const perimap_CardiacCycle* cycle = cycle_at(model, t_ns);
  Phase phase;
  if (cycle == nullptr || !well_formed(model) || !phase_at(model.cardiac_clock, *cycle, t_ns, phase)) return false;
  out.cardiac_phase_rad = phase.phase_rad;
  out.cardiac_phase_deviation_rad = phase.deviation_rad;
  out.cardiac_phase_rate_rad_per_s = phase.rate_rad_per_s;
  const Bases bases = bases_at(model, phase, t_ns);
  out.features.resize(model.features._length);
  for (std::size_t i = 0; i < out.features.size(); ++i) {
    if (!predict_feature(model.features._buffer[i], bases, out.features[i])) return false;
  }
  return true;
}

inline Refusal refusal_of(const perimap_SurfaceModel& model, std::int64_t t_ns, std::int64_t now_ns,
                          const Acceptance& acceptance, perimap_SurfaceState state) noexcept {
  if (now_ns > model.valid_until_ns) return Refusal::kStale;
  if (t_ns < model.valid_from_ns) return Refusal::kBeforeValidity;
  if (t_ns > model.valid_until_ns) return Refusal::kBeyondValidity;
  if (state == perimap_SURFACE_GOOD) return Refusal::kNone;
  if (state == perimap_SURFACE_DEGRADED) return acceptance.degraded ? Refusal::kNone : Refusal::kDegraded;
  return Refusal::kInvalid;
}

}  // namespace detail

// What a model is worth at an instant, whatever is evaluated with it.
struct SurfaceVerdict {
  Refusal refusal = Refusal::kMalformed;
  perimap_SurfaceState state = perimap_SURFACE_INVALID;
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
};

inline SurfaceVerdict verdict_at(const perimap_SurfaceModel& model, std::int64_t t_ns, std::int64_t now_ns,
                                 Acceptance acceptance) noexcept {
  SurfaceVerdict verdict{Refusal::kNone, model.state, model.reason};
  // A beat that is due by then and has not come: as perimapd itself will say it, unless something worse is the matter.
  if (t_ns > model.expected_until_ns && model.state != perimap_SURFACE_INVALID &&
      model.reason != perimap_SURFACE_REASON_RESPIRATION_UNKNOWN) {
    verdict.state = perimap_SURFACE_DEGRADED;
    verdict.reason = perimap_SURFACE_REASON_PHASE_FREE_RUNNING;
  }
  verdict.refusal = detail::refusal_of(model, t_ns, now_ns, acceptance, verdict.state);
  return verdict;
}

// The surface at t_ns, as known from `model` at now_ns. False when refused: surface.refusal, and reason where it is
// perimapd's, say why, and there are no features.
inline bool predict(const perimap_SurfaceModel& model, std::int64_t t_ns, std::int64_t now_ns, Acceptance acceptance,
                    PredictedSurface& surface) {
  surface.features.clear();
  surface.time_ns = t_ns;
  surface.cardiac_phase_rad = surface.cardiac_phase_deviation_rad = surface.cardiac_phase_rate_rad_per_s = 0.0;
  const SurfaceVerdict verdict = verdict_at(model, t_ns, now_ns, acceptance);
  surface.state = verdict.state;
  surface.reason = verdict.reason;
  surface.refusal = verdict.refusal;
  if (surface.refusal == Refusal::kNone && !detail::predict_features(model, t_ns, surface)) {
    surface.refusal = Refusal::kMalformed;
    surface.features.clear();
  }
  return surface.refusal == Refusal::kNone;
}

// An instant of UTC (PTP-disciplined on both hosts) on the clock of the model.
inline std::int64_t monotonic_of_utc(const perimap_SurfaceModel& model, std::int64_t utc_ns) noexcept {
  return utc_ns - (model.time_utc_ns - model.time_ns);
}

// For people; never null.
inline const char* describe(perimap_SurfaceReason reason) noexcept {
  switch (reason) {
    case perimap_SURFACE_REASON_NONE:
      return "no reason given";
    case perimap_SURFACE_REASON_NOTHING_MAPPED:
      return "nothing is mapped yet";
    case perimap_SURFACE_REASON_PHASE_UNKNOWN:
      return "too few heart beats seen yet";
    case perimap_SURFACE_REASON_PHASE_FREE_RUNNING:
      return "no heart beat where one was due";
    case perimap_SURFACE_REASON_PHASE_LOST:
      return "no heart beat for too long";
    case perimap_SURFACE_REASON_FRAME_MISSING:
      return "no camera frames";
    case perimap_SURFACE_REASON_UPDATE_LATE:
      return "the update came late";
    case perimap_SURFACE_REASON_POSE_MISSING:
      return "no pose of the scope";
    case perimap_SURFACE_REASON_PHASE_CONTRADICTED:
      return "the images contradict the ECG";
    case perimap_SURFACE_REASON_RESPIRATION_UNKNOWN:
      return "breathing is not known yet";
    case perimap_SURFACE_REASON_PHASE_FROM_IMAGE:
      return "the ECG is gone, the images carry on";
    case perimap_SURFACE_REASON_ECTOPIC_BEAT:
      return "a premature beat";
    case perimap_SURFACE_REASON_RHYTHM_UNPREDICTABLE:
      return "the rhythm cannot be predicted";
    case perimap_SURFACE_REASON_RHYTHM_ECTOPIC:
      return "premature beats prevail";
    case perimap_SURFACE_REASON_LAW_UNDECIDED:
      return "how the motion goes with the beat is not certain yet";
    case perimap_SURFACE_REASON_NOT_SEEN:
      return "the images do not show what is mapped";
    case perimap_SURFACE_REASON_NO_PARALLAX:
      return "the camera keeps still: how far away the surface is cannot be seen";
    case perimap_SURFACE_REASON_SETUP_DOUBTED:
      return "hand-eye, lens or time offset are doubted";
    case perimap_SURFACE_REASON_NOTHING_CONVERGED:
      return "no feature has converged yet";
    case perimap_SURFACE_REASON_SETUP_UNCERTAIN:
      return "what is seen has not confirmed hand-eye, lens and time offset yet";
    case perimap_SURFACE_REASON_SCOPE_UNREAD:
      return "how the scope is turned in its camera head cannot be read";
    case perimap_SURFACE_REASON_SCOPE_CHANGED:
      return "the scope has been turned or zoomed, and its turns are not calibrated";
    case perimap_SURFACE_REASON_POSE_REPEATED:
      return "the tracker gives the same pose again and again";
    case perimap_SURFACE_REASON_PICTURE_REPEATED:
      return "the camera gives the same picture again and again";
    case perimap_SURFACE_REASON_ORGAN_OR_TRACKER_MOVED:
      return "the organ has been moved, or the tracker errs";
    case perimap_SURFACE_REASON_ORGAN_MOVED:
      return "the organ has been moved, and the map is not with it yet";
    case perimap_SURFACE_REASON_TRACKER_ERRS:
      return "the tracker errs: the patient's tool has not moved as the surface seems to";
    default:
      return "a reason that this client does not know";
  }
}

// `reason` where the refusal is perimapd's own.
inline const char* describe(Refusal refusal, perimap_SurfaceReason reason) noexcept {
  switch (refusal) {
    case Refusal::kStale:
      return "perimapd is not heard any more";
    case Refusal::kBeforeValidity:
      return "the model does not reach so far back";
    case Refusal::kBeyondValidity:
      return "the model does not reach so far ahead";
    case Refusal::kMalformed:
      return "the model cannot be read";
    case Refusal::kInvalid:
    case Refusal::kDegraded:
    case Refusal::kNone:
      break;
  }
  return describe(reason);
}

inline const char* describe(const PredictedSurface& surface) noexcept {
  const bool good = surface.refusal == Refusal::kNone && surface.state == perimap_SURFACE_GOOD;
  return good ? "good" : describe(surface.refusal, surface.reason);
}

}  // namespace perimap::client
