// What the last beats were like: sizes and polarity.
#pragma once

#include "core/phase/qrs_candidate.hpp"
#include "core/phase/r_peak_detector_settings.hpp"
#include "core/phase/recent_values.hpp"

namespace perimap {

class BeatLevels {
 public:
  void learn(const QrsCandidate& beat) noexcept;
  void turn(const QrsCandidate& beat, const DecisionSettings& settings) noexcept;  // polarity and excursions
  void forget_size() noexcept;
  void clear() noexcept;

  [[nodiscard]] bool known() const noexcept { return energy_.count() > 0; }
  [[nodiscard]] double energy() const noexcept { return known() ? energy_.median() : 0.0; }
  [[nodiscard]] double sharpness() const noexcept { return known() ? sharpness_.median() : 0.0; }
  [[nodiscard]] double slope() const noexcept { return known() ? slope_.median() : 0.0; }
  [[nodiscard]] Polarity polarity() const noexcept { return {upward_ > 0.0 || downward_ > 0.0, points_up_}; }
  [[nodiscard]] double excursions() const noexcept { return upward_ + downward_; }
  [[nodiscard]] double height() const noexcept { return points_up_ ? upward_ : downward_; }
  // 1 for the usual beat.
  [[nodiscard]] double size(const QrsCandidate& candidate) const noexcept;
  // Power of noise of that level: 1 from where, bare, it now and then comes up to half a beat.
  [[nodiscard]] double noisiness(double noise, const DecisionSettings& settings) const noexcept;

 private:
  RecentValues<8> energy_;
  RecentValues<8> sharpness_;
  RecentValues<8> slope_;
  double upward_ = 0.0;  // excursions of the beats so far, fading mean
  double downward_ = 0.0;
  bool points_up_ = true;
};

}  // namespace perimap
