#include "core/phase/law_choice.hpp"

#include <algorithm>
#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

constexpr double kMemory = 100.0;  // cycles; the map learns on, and its phase's errors change
constexpr double kLeastCycles = 4.0;
constexpr double kDecisive = 4.0;     // difference of the log likelihoods
constexpr double kWildest_rad = 0.8;  // no phase but a wrong match
constexpr double kSameScale = 0.1;    // of the usual length
constexpr double kRuledOut = 1e-3;    // probability of a law that is not asked any more
// Enough to rule the others out, and outweighed by some cycles that say otherwise: what else moved the heart or the
// pictures in those seconds is in all the features alike.
constexpr double kMostOfATrial = 8.0;
constexpr double kKeep = 1.0 - 1.0 / kMemory;

}  // namespace

PhaseLawSettings law_even_at(PhaseLaw law, Seconds rr) noexcept {
  PhaseLawSettings settings;
  settings.law = law;
  settings.systole_fraction = systole_duration(settings, rr, rr) / rr;
  const LockedParts parts = locked_parts(settings, rr);
  settings.locked_systole_phase_rad = kTwoPi * parts.systole / rr;
  settings.locked_filling_phase_rad = kTwoPi * (1.0 - parts.filling / rr);
  return settings;
}

LawMemory LawChoice::memory() const noexcept {
  // What cut-short cycles alone have told gives way to the first other one.
  if (!any_in_rhythm_ || (taught_ < kCyclesForScale && belief_.settings.law == PhaseLaw::kLinear)) return {};
  return {belief_.settings.law, scale_, cycles_, squares_, evidence()};
}

void LawChoice::recall(const LawMemory& memory) noexcept {
  *this = LawChoice();
  if (!(memory.usual > Seconds(0.0))) return;
  any_in_rhythm_ = true;
  taught_ = length_count_ = kLengths;
  lengths_s_.fill(memory.usual.count());
  belief_.settings.law = memory.law;
  scale(memory.usual);
  cycles_ = memory.cycles;
  squares_ = memory.squares;
  trial_log_likelihoods_ = memory.log_likelihoods;
  believe();
}

bool LawChoice::on_beat(const CardiacClock& clock) noexcept {
  const CardiacCycle cycle = clock.cycle_at(clock.anchor() - Duration(1));
  if (!cycle.teaches) return false;
  for (double& likelihood : trial_log_likelihoods_) likelihood *= kKeep;
  if (usual_changes(cycle)) {
    weigh_again(clock);
  } else if (taught_ >= kCyclesForScale) {
    weigh(cycle);
  }
  const bool another = choose();
  believe();
  return another;
}

// A heart may begin with a run of ectopic beats: as long as phases are told by the linear law, which has no scale, the
// usual length may turn out another one. Cycles that a premature beat cut short tell it only where there are no others.
bool LawChoice::usual_changes(const CardiacCycle& cycle) noexcept {
  ++taught_;
  if (belief_.settings.law != PhaseLaw::kLinear) return false;
  const bool in_rhythm = cycle.irregularity == Duration::zero();
  if (in_rhythm && !any_in_rhythm_) {
    any_in_rhythm_ = true;
    length_count_ = 0;
  }
  if (in_rhythm || !any_in_rhythm_) lengths_s_[length_count_++ % kLengths] = to_seconds(cycle.length);
  const auto held = std::min(length_count_, kLengths);
  double sum_s = 0.0;
  for (std::size_t i = 0; i < held; ++i) sum_s += lengths_s_[i];
  const Seconds usual(sum_s / static_cast<double>(held));
  if (taught_ > kCyclesForScale && std::abs(usual / scale_ - 1.0) < kSameScale) return false;
  scale(usual);
  return taught_ >= kCyclesForScale;
}

// Under laws of a new scale what is still kept says something else.
void LawChoice::weigh_again(const CardiacClock& clock) noexcept {
  parts_ = {};
  cycles_ = 0.0;
  squares_ = {};
  log_likelihoods_ = {};
  std::array<CardiacCycle, CardiacClock::kCompletedCycles> cycles{};  // the newest first
  std::size_t count = 0;
  for (Instant end = clock.anchor(); count < cycles.size(); end = cycles[count++].begin) {
    cycles[count] = clock.cycle_at(end - Duration(1));
    if (cycles[count].length <= Duration::zero()) break;
  }
  while (count-- > 0) {
    if (cycles[count].teaches) weigh(cycles[count]);
  }
}

void LawChoice::scale(Seconds usual) noexcept {
  scale_ = usual;
  belief_.settings = law_even_at(belief_.settings.law, usual);
}

void LawChoice::weigh(const CardiacCycle& cycle) noexcept {
  int seen = 0;
  std::array<double, kLaws> squares{};
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    const ObservedPhase& observed = kept_[k];
    if (observed.time < cycle.begin || observed.time >= cycle.begin + cycle.length) continue;
    if (!(observed.deviation_rad > 0.0)) continue;
    if (seen++ == 0) {
      for (auto& of_law : parts_) {
        for (Part& part : of_law) part.weight *= kKeep;
      }
    }
    const double weight = 1.0 / (observed.deviation_rad * observed.deviation_rad);
    for (std::size_t law = 0; law < kLaws; ++law) {
      const CyclePhase phase =
          phase_in_cycle(belief_.with(kPhaseLaws[law]), Seconds(to_seconds(observed.time - cycle.begin)),
                         Seconds(cycle.length), Seconds(cycle.previous_length));
      const double difference = std::remainder(observed.phase_rad - phase.phase_rad, kTwoPi);
      if (std::abs(difference) > kWildest_rad) continue;
      const int part_of = std::min(static_cast<int>(phase.phase_rad / kTwoPi * kParts), kParts - 1);
      Part& part = parts_[law][static_cast<std::size_t>(part_of)];
      part.weight += weight;
      const double from_mean = difference - part.mean_rad;
      part.mean_rad += weight / part.weight * from_mean;
      squares[law] += weight * from_mean * (difference - part.mean_rad);
    }
  }
  if (seen == 0) return;
  cycles_ = kKeep * cycles_ + 1.0;
  for (std::size_t law = 0; law < kLaws; ++law) {
    const double square = squares[law] / seen;
    squares_[law] = kKeep * squares_[law] + square;
    log_likelihoods_[law] = kKeep * log_likelihoods_[law] - std::log1p(square);
  }
}

double LawChoice::scatter(PhaseLaw law) const noexcept {
  return cycles_ > 0.0 ? squares_[index_of(law)] / cycles_ : 0.0;
}

bool LawChoice::weigh(std::span<LawTrial> trials) noexcept {
  // What of a trial's time others have not told yet.
  const auto new_share = [this](const LawTrial& trial) {
    if (!(trial.end > std::max(trial.begin, tried_until_))) return 0.0;
    return to_seconds(trial.end - std::max(trial.begin, tried_until_)) / to_seconds(trial.end - trial.begin);
  };
  const auto end = std::partition(trials.begin(), trials.end(), [&](const LawTrial& t) { return new_share(t) > 0.0; });
  trials = trials.first(static_cast<std::size_t>(end - trials.begin()));
  if (trials.size() < kFewestTrials) return false;
  std::array<double, kLaws> excess{};
  for (std::size_t law = 0; law < kLaws; ++law) {
    const auto of = [&](const LawTrial& trial) {
      return new_share(trial) * (trial.costs[law] - *std::min_element(trial.costs.begin(), trial.costs.end()));
    };
    const auto middle = trials.begin() + static_cast<std::ptrdiff_t>(trials.size() / 2);
    std::nth_element(trials.begin(), middle, trials.end(),
                     [&](const LawTrial& left, const LawTrial& right) { return of(left) < of(right); });
    excess[law] = of(*middle);
  }
  // Where no law is the best for most features.
  const double least = *std::min_element(excess.begin(), excess.end());
  for (std::size_t law = 0; law < kLaws; ++law) {
    trial_log_likelihoods_[law] -= std::min(0.5 * (excess[law] - least), kMostOfATrial);
  }
  for (const LawTrial& trial : trials) tried_until_ = std::max(tried_until_, trial.end);
  const bool another = choose();
  believe();
  return another;
}

std::array<double, LawChoice::kLaws> LawChoice::evidence() const noexcept {
  std::array<double, kLaws> sum = trial_log_likelihoods_;
  if (cycles_ < kLeastCycles) return sum;
  for (std::size_t i = 0; i < kLaws; ++i) sum[i] += log_likelihoods_[i];
  return sum;
}

bool LawChoice::choose() noexcept {
  // The scale of a law that is told stays.
  const bool scaled = any_in_rhythm_ && length_count_ >= kRhythmicCyclesForScale;
  if (!scaled && taught_ < kCyclesForScale) return false;
  const std::array<double, kLaws> likelihoods = evidence();
  const auto best =
      static_cast<std::size_t>(std::max_element(likelihoods.begin(), likelihoods.end()) - likelihoods.begin());
  if (!(likelihoods[best] - likelihoods[index_of(belief_.settings.law)] > kDecisive)) return false;
  belief_.settings.law = kPhaseLaws[best];
  return true;
}

// Any law is as likely as another beforehand.
void LawChoice::believe() noexcept {
  const std::array<double, kLaws> likelihoods = evidence();
  const double largest = *std::max_element(likelihoods.begin(), likelihoods.end());
  double sum = 0.0;
  for (std::size_t i = 0; i < kLaws; ++i) {
    const double likelihood = std::exp(likelihoods[i] - largest);
    belief_.probabilities[i] = likelihood < kRuledOut ? 0.0 : likelihood;
    sum += belief_.probabilities[i];
  }
  for (double& probability : belief_.probabilities) probability /= sum;
}

}  // namespace perimap
