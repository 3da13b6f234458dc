// Where in the signal a QRS complex may be: at the maxima of the slope's energy, and where the slope is like a cluster
// of beats (a matched filter on running templates, which finds beats in noise that is stronger than they are).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "core/phase/ecg_filter.hpp"
#include "core/phase/qrs_candidate.hpp"
#include "core/phase/qrs_clusters.hpp"
#include "core/phase/r_peak_detector_settings.hpp"

namespace perimap {

class CandidateFinder {
 public:
  CandidateFinder(const CandidateSettings& settings, const EcgFilter& filter) noexcept
      : settings_(settings), filter_(filter), meter_(settings, filter) {}

  void set_period(Duration period) noexcept { meter_.set_period(period); }
  void restart() noexcept;

  // The filter has a new sample: what becomes a candidate by it, for `each`, at most some.
  template <class Each>
  void follow(const QrsClusters& clusters, Polarity polarity, double quiet, Each&& each) noexcept;

 private:
  static constexpr int kPending = 8;

  // How much the signal around a sample looks like beats.
  struct Fit {
    std::int64_t at = 0;
    double correlation = 0.0;
    int of = -1;
  };

  [[nodiscard]] bool follow_energy() noexcept;
  [[nodiscard]] std::optional<Fit> follow_templates(const QrsClusters& clusters) noexcept;

  const CandidateSettings& settings_;
  const EcgFilter& filter_;
  QrsMeter meter_;
  bool rising_ = true;
  double crest_ = 0.0;
  std::int64_t crest_at_ = 0;
  double trough_ = 0.0;
  std::array<std::int64_t, kPending> crests_{};  // that wait for what follows them
  int crest_count_ = 0;
  Fit best_fit_;  // of the maximum that is being passed; none when its `of` is -1
};

template <class Each>
void CandidateFinder::follow(const QrsClusters& clusters, Polarity polarity, double quiet, Each&& each) noexcept {
  if (follow_energy() && crest_count_ < kPending) crests_[static_cast<std::size_t>(crest_count_++)] = crest_at_;
  if (filter_.now() % meter_.step() == 0) {
    if (const auto fit = follow_templates(clusters)) {
      const QrsCandidate candidate = meter_.about_fit(fit->at, clusters.upward(fit->of), polarity, quiet);
      if (candidate.energy > settings_.quanta * filter_.quantum_mV()) each(candidate);
    }
  }
  const int await = filter_.slope_delay() + meter_.points_after() * meter_.step();
  const int longest = await + filter_.samples_in(settings_.peak_window);
  while (crest_count_ > 0 && filter_.now() >= crests_[0] - filter_.energy_delay() + await) {
    const std::int64_t crest = crests_[0];
    const double least = std::max(settings_.least_of_quiet * quiet, settings_.quanta * filter_.quantum_mV());
    if (filter_.at(crest).energy > least) {
      const QrsCandidate candidate = meter_.about_crest(crest, polarity, quiet);
      // The peak of a wide complex may lie so late that its shape is not whole yet.
      if (candidate.shape.points == 0 && filter_.now() < crest - filter_.energy_delay() + longest) return;
      each(candidate);
    }
    for (int i = 1; i < crest_count_; ++i) {
      crests_[static_cast<std::size_t>(i - 1)] = crests_[static_cast<std::size_t>(i)];
    }
    --crest_count_;
  }
}

}  // namespace perimap
