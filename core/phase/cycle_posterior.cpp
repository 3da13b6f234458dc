#include "core/phase/cycle_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

constexpr double kLengthSpan = 4.0;     // deviations to either side
constexpr double kBeginningSpan = 2.5;  // likewise
constexpr double kLeastBeginDeviation_s = 1e-3;
constexpr double kLeastLengthDeviation = 0.005;   // share of the length
constexpr double kFreedom = 3.0;                  // of Student's likelihood
constexpr double kMissedBeatDeviation_s = 0.010;  // of the detector's delay
constexpr double kLargestSquare = 9.0;
constexpr double kContradicts = 3.0;  // deviations
constexpr double kContradicted_s = 0.15;
// Less than this moves no surface by more than about a millimetre (48 mm/s RMS on a heart); the deviation says enough.
constexpr double kWorthSaying_s = 0.02;
// Below this many observations the misfit says little.
constexpr int kEnoughForMisfit = 5;
// A carried cycle ends for good when the next has run so far: by then the images have shown its beginning.
constexpr double kRolled = 0.3;
constexpr double kCarriedDeviation = 1.5;         // of a carried cycle's length, to that of one after a known beat
constexpr double kLargestBeginDeviation = 0.125;  // of the length
constexpr Duration kSeen = std::chrono::milliseconds(500);
// By so much of the length the beginning may be moved for the end's sake.
constexpr double kLargestGivingWay = 0.03;
constexpr int kHalvings = 6;     // towards the farthest move of the end that there is a beginning for
constexpr int kBisections = 24;  // of twice 3 % of a length: to nanoseconds

// Where the i-th of n even steps from -span to span lies.
double step_of(int i, int n, double span) noexcept { return span * (2.0 * i / (n - 1) - 1.0); }

// Variance of an even distribution over one such step: nothing is known better between two of them.
double step_variance(int n, double span) noexcept {
  const double step = 2.0 * span / (n - 1);
  return step * step / 12.0;
}

double student_log_likelihood(double square) noexcept {
  return -0.5 * (kFreedom + 1.0) * std::log1p(square / kFreedom);
}

}  // namespace

double CyclePosterior::begin_s(int i) const noexcept {
  return begin_deviation_s_ * step_of(i, kBeginnings, kBeginningSpan);
}

double CyclePosterior::length_s(int j) const noexcept {
  return length_mean_s_ + length_deviation_s_ * step_of(j, kLengths, kLengthSpan);
}

void CyclePosterior::follow(const CardiacClock& clock, Instant now) noexcept {
  now_ = now;
  if (clock.at(now).state != PhaseState::kLocked) {
    carry_on(clock);
    return;
  }
  // Under another law what was observed in this cycle is weighed again.
  const bool anew = !locked_ || carried_ || clock.beats() != beats_ || clock.law().law != law_.law;
  const bool ended = locked_ && !carried_ && clock.beats() == beats_ + 1;
  locked_ = true;
  carried_ = false;
  if (!anew) return;
  if (ended && clock.cycle_at(r_peak_).teaches) trust().score(clock.anchor());
  for (EndTrust& each : trust_) each.discard();
  beats_ = clock.beats();
  begin_cycle(clock);
}

void CyclePosterior::carry_on(const CardiacClock& clock) noexcept {
  if (!locked_) return;
  if (!carried_) {
    carried_ = true;
    carried_since_ = now_;
    ahead_ = 0;
  }
  if (!any_observed_ || now_ - last_observed_ > kBlind || now_ - carried_since_ > carry_) {
    locked_ = false;
    return;
  }
  const CycleCorrection cycle = correction();
  const Instant end = cycle.begin + cycle.length;
  if (to_seconds(now_ - end) < kRolled * next_length_s_) return;
  // As long as was predicted before the ECG went, or as the last was: rhythms wander.
  const double predicted_s = to_seconds(clock.predicted_length(std::min(++ahead_, CardiacClock::kPredictedCycles - 1)));
  r_peak_ = end;
  // From its R peak, where there was one.
  previous_length_s_ = to_seconds(cycle.length + cycle.given_way);
  length_mean_s_ = 0.5 * (predicted_s + previous_length_s_);
  next_length_s_ = length_mean_s_;
  length_deviation_s_ = kCarriedDeviation * to_seconds(clock.length_deviation());
  begin_deviation_s_ = std::min(std::hypot(to_seconds(cycle.begin_deviation), to_seconds(cycle.length_deviation)),
                                kLargestBeginDeviation * length_mean_s_);
  begin_grid();
}

void CyclePosterior::begin_cycle(const CardiacClock& clock) noexcept {
  law_ = clock.law();
  r_peak_ = clock.anchor();
  detector_delay_ = clock.detector_delay();
  begin_deviation_s_ = to_seconds(clock.anchor_deviation());
  length_mean_s_ = to_seconds(clock.predicted_length());
  length_deviation_s_ = to_seconds(clock.length_deviation());
  previous_length_s_ = to_seconds(clock.last_rr());
  if (previous_length_s_ <= 0.0) previous_length_s_ = length_mean_s_;
  next_length_s_ = to_seconds(clock.predicted_length(1));
  begin_grid();
}

// The prior on the grid, and what was observed since the beginning.
void CyclePosterior::begin_grid() noexcept {
  begin_deviation_s_ = std::max(begin_deviation_s_, kLeastBeginDeviation_s);
  length_deviation_s_ = std::max(length_deviation_s_, kLeastLengthDeviation * length_mean_s_);
  // A length must stay one.
  length_deviation_s_ = std::min(length_deviation_s_, 0.5 * length_mean_s_ / kLengthSpan);
  contradicted_ = false;
  observed_ = 0;
  seen_until_ = r_peak_;
  for (int i = 0; i < kBeginnings; ++i) {
    for (int j = 0; j < kLengths; ++j) {
      const double b = begin_s(i) / begin_deviation_s_;
      const double l = (length_s(j) - length_mean_s_) / length_deviation_s_;
      candidate(i, j) = {-0.5 * (b * b + l * l), 0.0};
    }
  }
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    if (kept_[k].time >= r_peak_) weigh(kept_[k]);
  }
}

void CyclePosterior::add(const ObservedPhase& observed) noexcept {
  kept_.add(observed);
  any_observed_ = true;
  last_observed_ = observed.time;
  contradicted_ = false;
  if (!locked_ || observed.time < r_peak_) return;
  weigh(observed);
  foretell();
}

void CyclePosterior::weigh(const ObservedPhase& observed) noexcept {
  if (length_mean_s_ <= 0.0) return;
  ++observed_;
  seen_until_ = std::max(seen_until_, observed.time);
  for (int i = 0; i < kBeginnings; ++i) {
    for (int j = 0; j < kLengths; ++j) {
      const CyclePhase phase = phase_of(observed.time, begin_s(i), length_s(j), next_length_s_);
      const bool past_end = to_seconds(observed.time - r_peak_) - begin_s(i) >= length_s(j);
      const double difference = std::remainder(observed.phase_rad - phase.phase_rad, kTwoPi);
      // Past the end runs a cycle whose own length is only predicted.
      const double loose = past_end ? phase.length_sensitivity * phase.rate_rad_per_s * length_deviation_s_ : 0.0;
      const double square = difference * difference / (observed.deviation_rad * observed.deviation_rad + loose * loose);
      Candidate& c = candidate(i, j);
      c.log_likelihood += student_log_likelihood(square);
      c.misfit += std::min(square, kLargestSquare);
    }
  }
}

CyclePhase CyclePosterior::phase_of(Instant t, double begin_s, double length_s, double next_s) const noexcept {
  const double since_s = to_seconds(t - r_peak_) - begin_s;
  return since_s < length_s
             ? phase_in_cycle(law_, Seconds(since_s), Seconds(length_s), Seconds(previous_length_s_ + begin_s))
             : phase_in_cycle(law_, Seconds(since_s - length_s), Seconds(next_s), Seconds(length_s));
}

double CyclePosterior::contradiction_s(double begin_s, double length_s,
                                       const CycleCorrection& correction) const noexcept {
  if (contradicted_) return kContradicted_s;
  if (kept_.size() == 0) return 0.0;
  const ObservedPhase& newest = kept_.newest();
  if (newest.time < r_peak_) return 0.0;
  const double next_s = correction.next_length > Duration::zero() ? to_seconds(correction.next_length) : next_length_s_;
  const CyclePhase phase = phase_of(newest.time, begin_s, length_s, next_s);
  const double difference = std::abs(std::remainder(newest.phase_rad - phase.phase_rad, kTwoPi));
  return difference > kContradicts * newest.deviation_rad ? difference / phase.rate_rad_per_s : 0.0;
}

std::optional<CyclePosterior::Summary> CyclePosterior::summary() const noexcept {
  const double known_until_s = to_seconds(now_ - detector_delay_ - r_peak_);
  std::array<double, kLengths * kBeginnings> log_weights{};
  double best = -std::numeric_limits<double>::infinity();
  double best_misfit = 0.0;
  for (int i = 0; i < kBeginnings; ++i) {
    for (int j = 0; j < kLengths; ++j) {
      const auto k = static_cast<std::size_t>(i * kLengths + j);
      // Where the ECG tells nothing, a beat that it does not tell says nothing.
      const double overdue =
          carried_ ? 0.0 : std::max(0.0, known_until_s - begin_s(i) - length_s(j)) / kMissedBeatDeviation_s;
      log_weights[k] = grid_[k].log_likelihood - 0.5 * overdue * overdue;
      if (log_weights[k] <= best) continue;
      best = log_weights[k];
      best_misfit = grid_[k].misfit;
    }
  }
  double sum = 0.0;
  double begin = 0.0;
  double begin_square = 0.0;
  double length = 0.0;
  double length_square = 0.0;
  for (int i = 0; i < kBeginnings; ++i) {
    for (int j = 0; j < kLengths; ++j) {
      const double weight = std::exp(log_weights[static_cast<std::size_t>(i * kLengths + j)] - best);
      const double b = begin_s(i);
      const double l = length_s(j) - length_mean_s_;
      sum += weight;
      begin += weight * b;
      begin_square += weight * b * b;
      length += weight * l;
      length_square += weight * l * l;
    }
  }
  if (!(sum > 0.0) || !std::isfinite(sum)) return std::nullopt;
  begin /= sum;
  length /= sum;
  Summary cycle;
  cycle.begin_s = begin;
  cycle.length_s = length_mean_s_ + length;
  cycle.begin_variance_s2 =
      std::max(begin_square / sum - begin * begin, step_variance(kBeginnings, begin_deviation_s_ * kBeginningSpan));
  cycle.length_variance_s2 =
      std::max(length_square / sum - length * length, step_variance(kLengths, length_deviation_s_ * kLengthSpan));
  // Where even the best candidate does not explain the observations, they are worth less than they say.
  if (observed_ >= kEnoughForMisfit) {
    const double worse = std::max(1.0, best_misfit / observed_);
    cycle.begin_variance_s2 *= worse;
    cycle.length_variance_s2 *= worse;
  }
  return cycle;
}

double CyclePosterior::seen_sensitivity(double begin_s, double length_s) const noexcept {
  const double since_s = to_seconds(seen_until_ - r_peak_) - begin_s;
  return since_s < length_s ? phase_of(seen_until_, begin_s, length_s, next_length_s_).length_sensitivity : 1.0;
}

void CyclePosterior::foretell() noexcept {
  if (carried_ || trust().foretold()) return;
  // A summary costs as much as weighing an observation: only about where it counts.
  const double about = seen_sensitivity(0.0, length_mean_s_);
  if (about < 0.8 * EndTrust::kLeastSensitivity || about > 1.1 * EndTrust::kMostSensitivity) return;
  const std::optional<Summary> cycle = summary();
  if (!cycle) return;
  trust().foretell({r_peak_ + from_seconds(length_mean_s_), from_seconds(std::sqrt(predicted_variance_s2())),
                    from_seconds(cycle->end_s() - length_mean_s_)},
                   seen_sensitivity(cycle->begin_s, cycle->length_s));
}

CyclePosterior::Summary CyclePosterior::with_trusted_end(const Summary& seen) const noexcept {
  // A carried cycle that follows another has no R peak at either end.
  if (observed_ == 0 || (carried_ && ahead_ > 0)) return seen;
  const double weight = trust().weight(seen_sensitivity(seen.begin_s, seen.length_s), predicted_variance_s2());
  if (weight >= 1.0) return seen;
  // Up to there the detector has heard, and no R peak.
  const double heard_s = to_seconds((carried_ ? carried_since_ : now_) - detector_delay_ - r_peak_);
  const double pull = length_mean_s_ - seen.end_s();
  const double wanted = std::max((1.0 - weight) * pull, std::min(0.0, heard_s - seen.end_s()));
  Summary trusted = seen;
  // By as much of it as there is a beginning for.
  double reached = 0.0;
  double step = wanted;
  for (int i = 0; i <= kHalvings && reached != wanted; ++i) {
    const std::optional<double> begin = beginning_for(seen, seen.end_s() + reached + step);
    if (begin) {
      trusted.begin_s = *begin;
      reached += step;
    }
    step *= 0.5;
  }
  trusted.length_s = seen.end_s() + reached - trusted.begin_s;
  // The beginning is wrong by as much as it gave way, which is more than the end by what it was not moved. Otherwise
  // the end is as uncertain as what is kept of either prediction. So the phase seen last is told as more uncertain than
  // it is: one beginning and one length that are independent cannot tell that they err against each other.
  const double given_way = trusted.begin_s - seen.begin_s;
  const double kept_of_predicted = std::abs(pull) > 0.0 ? wanted / pull : 1.0 - weight;
  const double end_variance_s2 =
      seen.end_variance_s2() + kept_of_predicted * std::max(predicted_variance_s2() - seen.end_variance_s2(), 0.0);
  trusted.begin_variance_s2 = seen.begin_variance_s2 + given_way * given_way;
  trusted.length_variance_s2 = std::max(end_variance_s2 - trusted.begin_variance_s2, seen.length_variance_s2);
  return trusted;
}

std::optional<double> CyclePosterior::beginning_for(const Summary& seen, double end_s) const noexcept {
  const double phase_rad = phase_of(seen_until_, seen.begin_s, seen.length_s, next_length_s_).phase_rad;
  const double seen_s = to_seconds(seen_until_ - r_peak_);
  if (seen_s >= std::min(end_s, seen.end_s())) return std::nullopt;
  const double span_s = kLargestGivingWay * seen.length_s;
  double early = seen.begin_s - span_s;
  double late = seen.begin_s + span_s;
  // The later it begins, the earlier the phase.
  const auto ahead = [&](double begin_s) {
    return phase_of(seen_until_, begin_s, end_s - begin_s, next_length_s_).phase_rad >= phase_rad;
  };
  if (!ahead(early) || ahead(late)) return std::nullopt;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (early + late);
    (ahead(middle) ? early : late) = middle;
  }
  return 0.5 * (early + late);
}

CycleCorrection CyclePosterior::correction() const noexcept {
  CycleCorrection correction;
  if (!locked_ || (observed_ == 0 && !contradicted_ && !carried_)) return correction;
  const std::optional<Summary> seen = summary();
  if (!seen) return correction;
  const Summary cycle = with_trusted_end(*seen);
  correction.beats = beats_;
  correction.carried = carried_;
  correction.ahead = ahead_;
  correction.previous_length = from_seconds(previous_length_s_ + cycle.begin_s);
  correction.seen = carried_ && now_ - last_observed_ <= kSeen;
  correction.begin = r_peak_ + from_seconds(cycle.begin_s);
  correction.given_way = from_seconds(cycle.begin_s - seen->begin_s);
  correction.length = from_seconds(cycle.length_s);
  correction.length_deviation = from_seconds(std::sqrt(cycle.length_variance_s2));
  correct_next(cycle.begin_s, cycle.length_s, cycle.end_variance_s2(), correction);
  const double contradiction = contradiction_s(cycle.begin_s, cycle.length_s, correction);
  correction.begin_deviation = from_seconds(std::sqrt(cycle.begin_variance_s2 + contradiction * contradiction));
  correction.contradicted = contradiction > kWorthSaying_s;
  return correction;
}

// The length of the next cycle from what was observed since the end of this one.
void CyclePosterior::correct_next(double begin_s, double length_s, double end_variance_s2,
                                  CycleCorrection& correction) const noexcept {
  const Instant end = r_peak_ + from_seconds(begin_s + length_s);
  double log_weights[kLengths] = {};
  bool any = false;
  for (std::size_t k = kept_.size(); k > 0 && kept_[k - 1].time > end; --k) {
    const ObservedPhase& observed = kept_[k - 1];
    any = true;
    for (int j = 0; j < kLengths; ++j) {
      const double next = next_length_s_ + length_deviation_s_ * step_of(j, kLengths, kLengthSpan);
      const CyclePhase phase =
          phase_in_cycle(law_, Seconds(to_seconds(observed.time - end)), Seconds(next), Seconds(length_s));
      const double difference = std::remainder(observed.phase_rad - phase.phase_rad, kTwoPi);
      const double variance = observed.deviation_rad * observed.deviation_rad +
                              phase.rate_rad_per_s * phase.rate_rad_per_s * end_variance_s2;
      log_weights[j] += student_log_likelihood(difference * difference / variance);
    }
  }
  if (!any) return;
  const double best = *std::max_element(std::begin(log_weights), std::end(log_weights));
  double sum = 0.0;
  double mean = 0.0;
  double square = 0.0;
  for (int j = 0; j < kLengths; ++j) {
    const double deviations = step_of(j, kLengths, kLengthSpan);
    const double weight = std::exp(log_weights[j] - best - 0.5 * deviations * deviations);
    sum += weight;
    mean += weight * deviations;
    square += weight * deviations * deviations;
  }
  if (!(sum > 0.0)) return;
  mean /= sum;
  const double variance = std::max(square / sum - mean * mean, step_variance(kLengths, kLengthSpan));
  correction.next_length = from_seconds(next_length_s_ + length_deviation_s_ * mean);
  correction.next_length_deviation = from_seconds(length_deviation_s_ * std::sqrt(variance));
}

}  // namespace perimap
