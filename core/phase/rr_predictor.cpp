#include "core/phase/rr_predictor.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr int kPulled = 4;  // coefficients
constexpr double kLeastDeviation_s = 0.004;
constexpr double kShortestOfMean = 0.7;  // predictions stay within these shares of the window's mean
constexpr double kLongestOfMean = 1.3;

constexpr double kErrorMemory = 30.0;        // beats over which past errors fade
constexpr double kPriorWeight = 4.0;         // beats that the starting value counts for
constexpr double kPriorMemory = 6.0;         // beats over which it fades: some rhythms are far more even
constexpr double kPriorDeviation = 0.05;     // of the interval: resting sinus rhythm
constexpr double kLargestScoredError = 0.5;  // of the prediction: a missed beat must not count as a whole cycle's error

constexpr int kChangedAfter = 4;  // intervals beyond the clip, on one side of the median

constexpr double kNormalDeviation = 1.4826;  // a normal distribution's deviation, in median absolute deviations

// Of a copy, for the order is lost.
double median_of(const double* values, int count) noexcept {
  std::array<double, RrPredictor::kWindow> sorted{};
  std::copy(values, values + count, sorted.begin());
  return upper_median(sorted.begin(), sorted.begin() + count);
}

}  // namespace

void RrPredictor::score(Seconds rr) noexcept {
  if (count_ == 0) return;
  std::array<Seconds, 1> predicted{};
  predict(predicted);
  const double bound = kLargestScoredError * predicted[0].count();
  const double error = std::clamp(rr.count() - predicted[0].count(), -bound, bound);
  const double keep = 1.0 - 1.0 / kErrorMemory;
  squared_error_sum_s2_ = keep * squared_error_sum_s2_ + error * error;
  error_weight_ = keep * error_weight_ + 1.0;
  prior_weight_ *= 1.0 - 1.0 / kPriorMemory;
}

void RrPredictor::push(Seconds rr) noexcept {
  if (count_ > 0) {
    score(rr);
  } else {
    const double prior = kPriorDeviation * rr.count();
    prior_variance_s2_ = prior * prior;
    prior_weight_ = kPriorWeight;
  }
  if (count_ == kWindow) {
    std::copy(rr_s_.begin() + 1, rr_s_.end(), rr_s_.begin());
    --count_;
  }
  rr_s_[static_cast<std::size_t>(count_)] = rr.count();
  ++count_;
}

void RrPredictor::predict(std::span<Seconds> next) const noexcept {
  if (next.empty()) return;
  if (count_ == 0) {
    std::fill(next.begin(), next.end(), Seconds(0.0));
    return;
  }
  const auto held = std::span(rr_s_).first(static_cast<std::size_t>(count_));
  if (method_ == RrMethod::kMeanOf8) {
    const auto recent = held.last(std::min<std::size_t>(held.size(), 8));
    double sum = 0.0;
    for (const double rr : recent) sum += rr;
    std::fill(next.begin(), next.end(), Seconds(sum / static_cast<double>(recent.size())));
  } else if (method_ == RrMethod::kPrevious || count_ < kOrder + 6) {
    std::fill(next.begin(), next.end(), Seconds(held.back()));
  } else {
    predict_autoregressive(next);
  }
}

void RrPredictor::predict_autoregressive(std::span<Seconds> next) const noexcept {
  using Window = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kWindow, 1>;
  Window y = Eigen::Map<const Eigen::VectorXd>(rr_s_.data(), count_);
  if (std::isfinite(autoregression_.clip)) {
    const double median = median_of(y.data(), count_);
    Window distance = (y.array() - median).abs();
    const double reach =
        autoregression_.clip * (kNormalDeviation * median_of(distance.data(), count_) + kLeastDeviation_s);
    // So many in a row are no errors: the rhythm has changed, and what came before is no guide.
    const auto recent = y.tail<kChangedAfter>().array();
    if ((recent > median + reach).all() || (recent < median - reach).all()) {
      std::fill(next.begin(), next.end(), Seconds(recent.mean()));
      return;
    }
    y = y.array().max(median - reach).min(median + reach);
  }
  const double mean = y.mean();
  const Window z = y.array() - mean;
  const double sum_of_squares = z.squaredNorm();
  if (!(sum_of_squares > 0.0)) {
    std::fill(next.begin(), next.end(), Seconds(mean));
    return;
  }

  // Normal equations of z_i = sum_k c_k z_{i-1-k}, with ridge * sum of squares * |c - pull|^2 added.
  Eigen::Matrix<double, kOrder, kOrder> normal = Eigen::Matrix<double, kOrder, kOrder>::Identity();
  const double ridge = autoregression_.ridge * sum_of_squares;
  normal *= ridge;
  Eigen::Matrix<double, kOrder, 1> right = Eigen::Matrix<double, kOrder, 1>::Zero();
  right.head<kPulled>().setConstant(ridge * autoregression_.pull / kPulled);
  for (int i = kOrder; i < count_; ++i) {
    const Eigen::Matrix<double, kOrder, 1> past = z.segment<kOrder>(i - kOrder).reverse();
    normal += past * past.transpose();
    right += past * z[i];
  }
  const Eigen::Matrix<double, kOrder, 1> coefficients = normal.ldlt().solve(right);

  Eigen::Matrix<double, kOrder, 1> past = z.tail<kOrder>().reverse();
  for (Seconds& rr : next) {
    const double predicted = std::clamp(mean + coefficients.dot(past), kShortestOfMean * mean, kLongestOfMean * mean);
    rr = Seconds(predicted);
    for (int k = kOrder - 1; k > 0; --k) past[k] = past[k - 1];
    past[0] = predicted - mean;
  }
}

Seconds RrPredictor::deviation() const noexcept {
  const double weight = prior_weight_ + error_weight_;
  return Seconds(weight > 0.0 ? std::sqrt((prior_weight_ * prior_variance_s2_ + squared_error_sum_s2_) / weight) : 0.0);
}

}  // namespace perimap
