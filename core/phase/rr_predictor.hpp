// How long the next cardiac cycles will be, and how well that has been known so far.
//
// Heart rate wanders with breathing and blood pressure, so the last cycle alone is a poor guess of the next; an
// autoregressive model of the recent intervals follows those rhythms (Baselli et al., "Heart rate variability signal
// processing", Int. J. Bio-Medical Computing 20, 1987). The ridge keeps the fit sound when the rhythm is nearly
// constant.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/phase/seconds.hpp"

namespace perimap {

enum class RrMethod : std::uint8_t {
  kAutoregressive,  // AR(8) with ridge over the last 60 intervals, the previous one until there are 14
  kMeanOf8,
  kPrevious  // assumption A3 of Tully, Kantor & Choset (ICRA 2013)
};

// What keeps the fit sound: when the rhythm is nearly constant, and when intervals are wrong (noise shifts R peaks).
struct AutoregressionSettings {
  double ridge = 0.1;  // times the window's sum of squares
  // Where the ridge pulls the coefficients: their sum over the first four intervals, in equal parts. A rhythm that
  // wanders slowly has it near 1.
  double pull = 0.8;
  double clip =
      3.0;  // times the intervals' robust deviation (1.48 median absolute deviations + 4 ms) from their median
};

class RrPredictor {
 public:
  static constexpr int kOrder = 8;
  static constexpr int kWindow = 60;

  explicit RrPredictor(RrMethod method = RrMethod::kAutoregressive,
                       const AutoregressionSettings& autoregression = {}) noexcept
      : method_(method), autoregression_(autoregression) {}

  // Takes the interval that has just ended (> 0) and scores the prediction that stood for it.
  void push(Seconds rr) noexcept;
  // Scores only: for an interval that is no guide to the coming ones (an ectopic beat, a missed one).
  void score(Seconds rr) noexcept;

  // The next intervals in order, each predicted from those before it. Zero before the first push.
  void predict(std::span<Seconds> next) const noexcept;

  // Standard deviation of the one-step prediction: RMS of its past errors, older ones fading, started from 5 %, which
  // gives way within some twenty beats. Zero before the first push.
  [[nodiscard]] Seconds deviation() const noexcept;

  [[nodiscard]] int count() const noexcept { return count_; }  // intervals held, at most kWindow

 private:
  void predict_autoregressive(std::span<Seconds> next) const noexcept;

  RrMethod method_;
  AutoregressionSettings autoregression_;
  int count_ = 0;
  std::array<double, kWindow> rr_s_{};  // oldest first
  double prior_variance_s2_ = 0.0;
  double prior_weight_ = 0.0;  // intervals
  double squared_error_sum_s2_ = 0.0;
  double error_weight_ = 0.0;
};

}  // namespace perimap
