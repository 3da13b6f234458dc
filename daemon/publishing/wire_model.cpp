#include "daemon/publishing/wire_model.hpp"

#include <algorithm>

#include "daemon/publishing/model_moment.hpp"
#include "daemon/publishing/wire_states.hpp"
#include "daemon/publishing/wire_text.hpp"

namespace perimap {
namespace {

// So far back a subscriber may still evaluate, to draw over a frame that was captured before the model was made.
constexpr Duration kModelPast = std::chrono::seconds(1);

perimap_PhaseClock to_wire(const CardiacClock& clock, Instant now) noexcept {
  const CardiacCycle cycle = clock.cycle_at(now);
  perimap_PhaseClock wire{};
  wire.state = to_wire(clock.at(now).state);
  wire.law = to_wire(clock.law().law);
  wire.anchor_time_ns = to_ns(cycle.begin);
  wire.anchor_deviation_ns = cycle.begin_deviation.count();
  wire.length_ns = cycle.length.count();
  wire.length_deviation_ns = cycle.length_deviation.count();
  wire.systole_ns = cycle.systole.count();
  wire.systole_fraction = clock.law().systole_fraction;
  const LockedParts locked = locked_parts(clock.law(), Seconds(cycle.length));
  wire.locked_systole_ns = from_seconds(locked.systole.count()).count();
  wire.locked_filling_ns = from_seconds(locked.filling.count()).count();
  wire.locked_systole_phase_rad = clock.law().locked_systole_phase_rad;
  wire.locked_filling_phase_rad = clock.law().locked_filling_phase_rad;
  const LawBelief& belief = clock.law_belief();
  std::copy(belief.probabilities.begin(), belief.probabilities.end(), wire.law_probabilities);
  return wire;
}

perimap_RespiratoryClock to_wire(const RespiratoryClock& clock, Instant now) noexcept {
  const RespiratoryPhase phase = clock.at(now);
  perimap_RespiratoryClock wire{};
  wire.state = to_wire(clock.state);
  wire.length_ns = clock.period().count();
  if (phase.known) wire.anchor_time_ns = to_ns(now - from_seconds(phase.phase_rad / phase.rate_rad_per_s));
  wire.deviation_mm = phase.deviation_mm;
  if (clock.state == RespirationState::kLocked) {
    const double dt = to_seconds(now - clock.time);
    wire.slope_mm_per_rad = clock.slope_mm_per_rad;
    wire.phase_variance_rad2 =
        clock.phase_variance_rad2 + dt * (2.0 * clock.covariance_rad2_per_s + dt * clock.rate_variance_rad2_per_s2);
    wire.phase_rate_covariance_rad2_per_s = clock.covariance_rad2_per_s + dt * clock.rate_variance_rad2_per_s2;
    wire.rate_variance_rad2_per_s2 = clock.rate_variance_rad2_per_s2;
  }
  return wire;
}

perimap_CardiacCycle to_wire(const CardiacCycle& cycle, const PhaseLawSettings& law) noexcept {
  const LockedParts locked = locked_parts(law, Seconds(cycle.length));
  perimap_CardiacCycle wire{};
  wire.measured = cycle.completed;
  wire.stretches = stretches(law, cycle.length, cycle.previous_length);
  wire.begin_time_ns = to_ns(cycle.begin);
  wire.begin_deviation_ns = cycle.begin_deviation.count();
  wire.length_ns = cycle.length.count();
  wire.length_deviation_ns = cycle.length_deviation.count();
  wire.irregularity_ns = cycle.irregularity.count();
  wire.systole_ns = cycle.systole.count();
  wire.locked_systole_ns = from_seconds(locked.systole.count()).count();
  wire.locked_filling_ns = from_seconds(locked.filling.count()).count();
  wire.systole_slope = systole_slope(law, cycle.length, cycle.previous_length);
  wire.previous_length_deviation_ns = cycle.previous_length_deviation.count();
  return wire;
}

}  // namespace

WireModel::WireModel(const Identity& identity) {
  name_as(wire_, identity);
  copy_text(identity.frame_id, wire_.frame_id);
}

const perimap_SurfaceModel& WireModel::fill(const ModelMoment& moment) {
  const PhaseEstimate phase = moment.clock.at(moment.now);
  const SurfaceReason reason = reason_of(phase, moment.clock.rhythm(), moment.footing);
  ++wire_.sample_sequence;
  wire_.time_ns = to_ns(moment.now);
  wire_.time_utc_ns = to_ns(moment.now + moment.utc_minus_monotonic);
  wire_.state = perimap::to_wire(state_of(reason));
  wire_.reason = perimap::to_wire(reason);
  wire_.cardiac_harmonics = static_cast<std::uint32_t>(moment.layout.cardiac_harmonics);
  wire_.respiratory_harmonics = static_cast<std::uint32_t>(moment.layout.respiratory_harmonics);
  wire_.cardiac_clock = to_wire(moment.clock, moment.now);
  wire_.respiratory_clock = to_wire(moment.respiration, moment.now);
  fill_features(moment);
  fill_cycles(moment);
  return wire_;
}

// As SurfaceComposer has them, but for the covariance, which the workers evaluate for the surfaces alone.
void WireModel::fill_features(const ModelMoment& moment) {
  std::vector<const FeatureSnapshot*> order;
  for (const ShardSnapshot* snapshot : moment.snapshots) {
    for (const FeatureSnapshot& feature : snapshot->features) order.push_back(&feature);
  }
  std::sort(order.begin(), order.end(), [](const auto* a, const auto* b) { return a->id < b->id; });

  const PhaseState phase = moment.clock.at(moment.now).state;
  features_.resize(order.size());
  coefficients_.resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const FeatureSnapshot& feature = *order[i];
    const FeatureVerdict verdict = verdict_of({feature.state, feature.reason}, phase, moment.footing);
    coefficients_[i].assign(feature.x.data(), feature.x.data() + feature.x.size());
    perimap_ModelFeature& out = features_[i];
    out.id = feature.id;
    out.state = perimap::to_wire(verdict.state);
    out.reason = perimap::to_wire(verdict.reason);
    out.first_observed_time_ns = to_ns(feature.first_observed);
    out.first_observed_px[0] = feature.first_observed_px.x();
    out.first_observed_px[1] = feature.first_observed_px.y();
    out.largest_deviation_mm = moment.footing.doubts.largest_deviation_mm(feature.largest_deviation_mm);
    const auto n = static_cast<std::uint32_t>(coefficients_[i].size());
    out.coefficients_W_mm = {n, n, coefficients_[i].data(), false};
    out.last_observed_time_ns = to_ns(feature.last_observed);
  }
  const auto n = static_cast<std::uint32_t>(features_.size());
  wire_.features = {n, n, features_.data(), false};
}

void WireModel::fill_cycles(const ModelMoment& moment) {
  const CardiacClock& clock = moment.clock;
  wire_.valid_from_ns = wire_.expected_until_ns = wire_.valid_until_ns = to_ns(moment.now);
  cycles_.clear();
  CardiacCycle cycle = clock.cycle_at(moment.now);
  if (cycle.length > Duration(0)) {
    while (cycle.begin > moment.now - kModelPast) {
      const CardiacCycle before = clock.cycle_at(cycle.begin - Duration(1));
      if (before.length <= Duration(0) || before.begin + before.length != cycle.begin) break;
      cycle = before;
    }
    wire_.valid_from_ns = to_ns(cycle.begin);
    wire_.expected_until_ns = to_ns(clock.expected_until());
    const Instant valid_until = std::min(moment.now + moment.validity, clock.lost_from());
    wire_.valid_until_ns = to_ns(valid_until);
    while (cycle.length > Duration(0) && cycle.begin <= valid_until) {
      cycles_.push_back(to_wire(cycle, clock.law()));
      cycle = clock.cycle_at(cycle.begin + cycle.length);
    }
  }
  const auto n = static_cast<std::uint32_t>(cycles_.size());
  wire_.cardiac_cycles = {n, n, cycles_.data(), false};
}

WirePhase::WirePhase(const Identity& identity) { name_as(wire_, identity); }

const perimap_Phase& WirePhase::fill(const CardiacClock& clock, Instant now) noexcept {
  const PhaseEstimate phase = clock.at(now);
  ++wire_.sample_sequence;
  wire_.time_ns = to_ns(now);
  wire_.state = to_wire(phase.state);
  wire_.cardiac_phase_rad = phase.phase_rad;
  wire_.cardiac_phase_deviation_rad = phase.deviation_s * phase.rate_rad_per_s;
  wire_.cardiac_phase_rate_rad_per_s = phase.rate_rad_per_s;
  wire_.last_r_peak_time_ns = to_ns(clock.anchor());
  wire_.predicted_r_peak_time_ns = to_ns(clock.predicted_r_peak());
  wire_.predicted_r_peak_deviation_ns = clock.predicted_r_peak_deviation().count();
  wire_.beats = clock.beats();
  return wire_;
}

}  // namespace perimap
