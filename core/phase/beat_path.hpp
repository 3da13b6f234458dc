// Which of some candidates are beats, all of them weighed together: a renewal process.
//
// A path is a set of candidates that are the beats. Its weight is the product of the odds of each, given the beat
// before it, and of the probability that no other has come since the last one. Forward and backward sums over all paths
// (Rabiner 1989, of a semi-Markov chain) give each candidate's probability.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace perimap {

// Of the intervals between beats, and of having waited for one.
struct RhythmModel {
  double cycle_s = 0.0;  // usual; 0: not known
  double spread = 0.06;  // standard deviation of log(interval / cycle)

  // log of the density of an interval, to that of one without rhythm; what is shorter than the refractory time of the
  // ventricles is all but excluded.
  [[nodiscard]] double log_density(double rr_s) const noexcept;
  // Probability that no beat has come for so long.
  [[nodiscard]] double survival(double since_s) const noexcept;
};

class BeatPath {
 public:
  static constexpr int kMost = 16;

  // `odds(i, j)`: log odds of candidate j as the beat after i; i = -1: after what came before. `waited(i)`: probability
  // that no beat has come since i.
  template <class LogOdds, class Waited>
  void weigh(int count, LogOdds&& log_odds, Waited&& waited) noexcept;

  [[nodiscard]] double probability(int i) const noexcept { return probability_[static_cast<std::size_t>(i)]; }

 private:
  std::array<double, kMost> probability_{};
};

template <class LogOdds, class Waited>
void BeatPath::weigh(int count, LogOdds&& log_odds, Waited&& waited) noexcept {
  // Index 0 is what came before, candidate i is i + 1.
  std::array<std::array<double, kMost + 1>, kMost + 1> odds{};
  std::array<double, kMost + 1> forward{};
  std::array<double, kMost + 1> backward{};
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  for (int j = 1; j <= count; ++j) {
    for (int i = 0; i < j; ++i) odds[at(i)][at(j)] = std::exp(log_odds(i - 1, j - 1));
  }
  forward[0] = 1.0;
  for (int j = 1; j <= count; ++j) {
    for (int i = 0; i < j; ++i) forward[at(j)] += forward[at(i)] * odds[at(i)][at(j)];
  }
  for (int i = count; i >= 0; --i) {
    backward[at(i)] = waited(i - 1);
    for (int j = i + 1; j <= count; ++j) backward[at(i)] += odds[at(i)][at(j)] * backward[at(j)];
  }
  for (int j = 1; j <= count; ++j) {
    probability_[at(j - 1)] = backward[0] > 0.0 ? forward[at(j)] * backward[at(j)] / backward[0] : 0.0;
  }
}

}  // namespace perimap
