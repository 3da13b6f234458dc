#include "core/phase/rhythm_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr int kLeastIntervals = 24;
constexpr int kWarm = 12;              // intervals before the prediction is worth scoring
constexpr double kTolerance_s = 0.03;  // within which two intervals are similar; widened until enough pairs are
constexpr double kWiden = 1.25;
constexpr int kLeastMatches = 5;
constexpr double kUnpredictableFrom = -1.3;  // Lake & Moorman separate at -1.4
constexpr double kPredictableFrom = -1.6;
constexpr double kLeastSurprise = 0.10;
constexpr double kUsualSurprise = 0.08;

}  // namespace

void RhythmMonitor::clear() noexcept {
  count_ = 0;
  predictor_ = RrPredictor();
  rhythm_ = Rhythm::kUnknown;
}

void RhythmMonitor::push(Seconds rr) noexcept {
  if (count_ == kWindow) {
    std::copy(rr_s_.begin() + 1, rr_s_.end(), rr_s_.begin());
    std::copy(error_s_.begin() + 1, error_s_.end(), error_s_.begin());
    --count_;
  }
  std::array<Seconds, 1> predicted{};
  predictor_.predict(predicted);
  rr_s_[static_cast<std::size_t>(count_)] = rr.count();
  error_s_[static_cast<std::size_t>(count_)] = predictor_.count() >= kWarm ? (rr - predicted[0]).count() : 0.0;
  ++count_;
  predictor_.push(rr);
  if (count_ < kLeastIntervals) return;

  const auto at = [&](int i) { return rr_s_[static_cast<std::size_t>(i)]; };
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < count_; ++i) {
    sum += at(i);
    squares += error_s_[static_cast<std::size_t>(i)] * error_s_[static_cast<std::size_t>(i)];
  }
  const double mean = sum / count_;
  const int scored = std::min(count_, std::max(predictor_.count() - kWarm, 1));
  // Root mean square of the errors of predicting each interval from those before it.
  const double surprise = std::sqrt(squares / scored) / mean;

  // Pairs of similar intervals, and those of them whose successors are similar as well.
  double tolerance = kTolerance_s;
  int similar = 0;
  int followed = 0;
  for (;;) {
    similar = 0;
    followed = 0;
    for (int i = 0; i + 1 < count_; ++i) {
      for (int j = i + 1; j + 1 < count_; ++j) {
        if (std::abs(at(i) - at(j)) >= tolerance) continue;
        ++similar;
        if (std::abs(at(i + 1) - at(j + 1)) < tolerance) ++followed;
      }
    }
    if (followed >= kLeastMatches || tolerance > mean) break;
    tolerance *= kWiden;
  }
  // Coefficient of sample entropy, natural logarithm.
  const double entropy =
      std::log(static_cast<double>(similar) / std::max(followed, 1)) + std::log(2.0 * tolerance / mean);
  const bool was = rhythm_ == Rhythm::kUnpredictable;
  const bool unpredictable =
      entropy > (was ? kPredictableFrom : kUnpredictableFrom) && surprise > (was ? kUsualSurprise : kLeastSurprise);
  rhythm_ = unpredictable ? Rhythm::kUnpredictable : Rhythm::kPredictable;
}

}  // namespace perimap
