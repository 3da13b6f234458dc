#include "core/phase/law_choice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr std::array<PhaseLaw, LawChoice::kLaws> kCandidates{PhaseLaw::kLinear, PhaseLaw::kWarped,
                                                             PhaseLaw::kTimeLocked};
constexpr double kMemory = 100.0;  // cycles; the map learns on, and its phase's errors change
constexpr double kLeastCycles = 4.0;
constexpr double kDecisive = 4.0;     // difference of the log likelihoods
constexpr double kWildest_rad = 0.8;  // no phase but a wrong match

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

bool LawChoice::on_beat(const CardiacClock& clock) noexcept {
  const CardiacCycle cycle = clock.cycle_at(clock.anchor() - Duration(1));
  if (!cycle.teaches || !scale(Seconds(cycle.length))) return false;
  weigh(cycle);
  return choose();
}

// True once the laws are scaled.
bool LawChoice::scale(Seconds rr) noexcept {
  if (length_count_ == kCyclesForScale) return true;
  lengths_s_[static_cast<std::size_t>(length_count_++)] = rr.count();
  if (length_count_ < kCyclesForScale) return false;
  const Seconds usual(upper_median(lengths_s_.begin(), lengths_s_.end()));
  for (std::size_t i = 0; i < kLaws; ++i) laws_[i] = law_even_at(kCandidates[i], usual);
  return true;
}

void LawChoice::weigh(const CardiacCycle& cycle) noexcept {
  constexpr double kKeep = 1.0 - 1.0 / kMemory;
  int seen = 0;
  std::array<double, kLaws> squares{};
  const std::uint64_t oldest = kept_count_ > kKept ? kept_count_ - kKept : 0;
  for (std::uint64_t k = oldest; k < kept_count_; ++k) {
    const ObservedPhase& observed = kept_[k % kKept];
    if (observed.time < cycle.begin || observed.time >= cycle.begin + cycle.length) continue;
    if (!(observed.deviation_rad > 0.0)) continue;
    if (seen++ == 0) {
      for (auto& of_law : parts_) {
        for (Part& part : of_law) part.weight *= kKeep;
      }
    }
    const double weight = 1.0 / (observed.deviation_rad * observed.deviation_rad);
    for (std::size_t law = 0; law < kLaws; ++law) {
      const CyclePhase phase = phase_in_cycle(laws_[law], Seconds(to_seconds(observed.time - cycle.begin)),
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
  const auto found = std::find(kCandidates.begin(), kCandidates.end(), law);
  return cycles_ > 0.0 ? squares_[static_cast<std::size_t>(found - kCandidates.begin())] / cycles_ : 0.0;
}

bool LawChoice::choose() noexcept {
  if (cycles_ < kLeastCycles) return false;
  const auto best =
      static_cast<int>(std::max_element(log_likelihoods_.begin(), log_likelihoods_.end()) - log_likelihoods_.begin());
  const auto likelihood = [this](int law) { return log_likelihoods_[static_cast<std::size_t>(law)]; };
  if (!(likelihood(best) - likelihood(chosen_) > kDecisive)) return false;
  chosen_ = best;
  return true;
}

}  // namespace perimap
