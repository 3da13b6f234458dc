#include "core/calibration/time_correlation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/calibration/residual_correlation.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

std::size_t even_count(double begin_s, double end_s, double interval_s) {
  return end_s > begin_s ? static_cast<std::size_t>((end_s - begin_s) / interval_s) + 1 : 1;
}

struct ValueAt {
  double value = 0.0;
  double slope = 0.0;  // per second, over the samples around
};

std::optional<ValueAt> value_at(const std::vector<TimedValue>& samples, double t_s, double longest_gap_s) {
  const auto after =
      std::lower_bound(samples.begin(), samples.end(), t_s, [](const TimedValue& v, double t) { return v.t_s < t; });
  if (after == samples.end() || after == samples.begin()) return std::nullopt;
  const auto before = after - 1;
  const double gap_s = after->t_s - before->t_s;
  if (gap_s > longest_gap_s) return std::nullopt;
  const double s = (t_s - before->t_s) / gap_s;
  return ValueAt{(1.0 - s) * before->value + s * after->value, (after->value - before->value) / gap_s};
}

// Over the samples that both have at this lag of whole intervals; not a number when they are too few or constant.
double correlation_at(const EvenSignal& first, const EvenSignal& second, std::ptrdiff_t lag, std::size_t fewest,
                      std::size_t& count) {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  const auto size = static_cast<std::ptrdiff_t>(second.values.size());
  for (std::size_t i = 0; i < first.values.size(); ++i) {
    const std::ptrdiff_t j = static_cast<std::ptrdiff_t>(i) - lag;
    if (j < 0 || j >= size) continue;
    const double a = first.values[i];
    const double b = second.values[static_cast<std::size_t>(j)];
    if (!std::isfinite(a) || !std::isfinite(b)) continue;
    n += 1, sa += a, sb += b, saa += a * a, sbb += b * b, sab += a * b;
  }
  count = static_cast<std::size_t>(n);
  if (count < fewest || count < 3) return kMissing;
  const double va = saa / n - sa * sa / n / n, vb = sbb / n - sb * sb / n / n;
  if (!(va > 1e-12 * saa / n) || !(vb > 1e-12 * sbb / n)) return kMissing;
  return (sab / n - sa * sb / n / n) / std::sqrt(va * vb);
}

}  // namespace

EvenSignal angular_speed(const std::vector<TimedPose>& poses, double interval_s, double span_s, double longest_gap_s) {
  EvenSignal signal{poses.empty() ? 0.0 : poses.front().t_s, interval_s, {}};
  if (poses.size() < 2) return signal;
  const std::size_t count = even_count(poses.front().t_s, poses.back().t_s, interval_s);
  for (std::size_t i = 0; i < count; ++i) {
    const double t_s = signal.begin_s + interval_s * static_cast<double>(i);
    const auto before = pose_at(poses, t_s - 0.5 * span_s, longest_gap_s);
    const auto after = pose_at(poses, t_s + 0.5 * span_s, longest_gap_s);
    signal.values.push_back(before && after ? so3_log(before->X.R.transpose() * after->X.R).norm() / span_s : kMissing);
  }
  return signal;
}

EvenSignal at_even_times(const std::vector<TimedValue>& samples, double interval_s, double longest_gap_s) {
  EvenSignal signal{samples.empty() ? 0.0 : samples.front().t_s, interval_s, {}};
  if (samples.size() < 2) return signal;
  const std::size_t count = even_count(samples.front().t_s, samples.back().t_s, interval_s);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = value_at(samples, signal.begin_s + interval_s * static_cast<double>(i), longest_gap_s);
    signal.values.push_back(at ? at->value : kMissing);
  }
  return signal;
}

std::optional<Correlation> correlate(const EvenSignal& first, const EvenSignal& second, double largest_offset_s,
                                     double shortest_overlap_s, bool either_sign) {
  const double interval_s = first.interval_s;
  // Sample i of the first and i - lag of the second are (begin_1 - begin_2 + lag * interval) apart.
  const double apart_s = first.begin_s - second.begin_s;
  const auto lowest = static_cast<std::ptrdiff_t>(std::ceil((-largest_offset_s - apart_s) / interval_s));
  const auto highest = static_cast<std::ptrdiff_t>(std::floor((largest_offset_s - apart_s) / interval_s));
  const auto fewest = static_cast<std::size_t>(std::max(3.0, shortest_overlap_s / interval_s));
  std::vector<double> height;
  std::vector<double> signed_height;
  std::vector<std::size_t> counts;
  for (std::ptrdiff_t lag = lowest; lag <= highest; ++lag) {
    std::size_t count = 0;
    const double r = correlation_at(first, second, lag, fewest, count);
    signed_height.push_back(r);
    height.push_back(!std::isfinite(r) ? -1.0 : either_sign ? std::abs(r) : r);
    counts.push_back(count);
  }
  if (height.empty()) return std::nullopt;
  const auto best = static_cast<std::size_t>(std::max_element(height.begin(), height.end()) - height.begin());
  if (height[best] <= -1.0) return std::nullopt;
  const auto offset_of = [&](double k) { return apart_s + (static_cast<double>(lowest) + k) * interval_s; };
  Correlation result;
  double vertex = 0.0;
  if (best > 0 && best + 1 < height.size() && height[best - 1] > -1.0 && height[best + 1] > -1.0) {
    const double bend = height[best - 1] - 2.0 * height[best] + height[best + 1];
    if (bend < 0.0) vertex = 0.5 * (height[best - 1] - height[best + 1]) / bend;
  }
  result.offset_s = offset_of(static_cast<double>(best) + std::clamp(vertex, -0.5, 0.5));
  result.correlation = signed_height[best];
  result.overlap_s = static_cast<double>(counts[best]) * interval_s;
  for (std::size_t k = 1; k + 1 < height.size(); ++k) {
    const bool peak = height[k] >= height[k - 1] && height[k] >= height[k + 1];
    // Noise makes small peaks on the slopes of a large one.
    const auto [from, to] = std::minmax(k, best);
    const double valley = *std::min_element(height.begin() + static_cast<std::ptrdiff_t>(from),
                                            height.begin() + static_cast<std::ptrdiff_t>(to) + 1);
    if (peak && k != best && valley < 0.9 * height[k] && height[k] > result.rival && height[k - 1] > -1.0 &&
        height[k + 1] > -1.0) {
      result.rival = height[k];
      result.rival_offset_s = offset_of(static_cast<double>(k));
    }
  }
  return result;
}

std::optional<FittedOffset> fit_offset(const std::vector<TimedValue>& first, const std::vector<TimedValue>& second,
                                       double offset_s, double longest_gap_s) {
  FittedOffset fit;
  fit.offset_s = offset_s;
  double limit = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 30; ++round) {
    // The offset's derivative is -gain * slope; the gain's and the constant's are the value and 1.
    std::vector<Vector3d> rows;
    std::vector<double> values;
    std::vector<double> residuals;
    double gain = fit.gain;
    for (int pass = 0; pass < 2; ++pass) {
      rows.clear(), values.clear();
      for (const TimedValue& sample : first) {
        const auto at = value_at(second, sample.t_s - fit.offset_s, longest_gap_s);
        if (!at) continue;
        rows.emplace_back(at->value, 1.0, -gain * at->slope);
        values.push_back(sample.value);
      }
      if (rows.size() < 10) return std::nullopt;
      if (gain != 0.0) break;
      // The first time: gain and constant alone.
      Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
      Eigen::Vector2d g = Eigen::Vector2d::Zero();
      for (std::size_t i = 0; i < rows.size(); ++i) {
        H += rows[i].head<2>() * rows[i].head<2>().transpose();
        g += rows[i].head<2>() * values[i];
      }
      gain = H.ldlt().solve(g)[0];
    }
    Matrix3d H = Matrix3d::Zero();
    Vector3d g = Vector3d::Zero();
    const auto solve = [&](const std::vector<double>* errors) {
      H.setZero(), g.setZero();
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (errors != nullptr && std::abs((*errors)[i]) > limit) continue;
        H += rows[i] * rows[i].transpose();
        g += rows[i] * values[i];
      }
      return Vector3d(H.ldlt().solve(g));
    };
    Vector3d x = solve(nullptr);
    for (int trim = 0; trim < 3; ++trim) {
      residuals.clear();
      for (std::size_t i = 0; i < rows.size(); ++i) residuals.push_back(values[i] - rows[i].dot(x));
      std::vector<double> sizes;
      for (const double r : residuals) sizes.push_back(std::abs(r));
      limit = std::max(1e-12, 4.0 * 1.4826 * upper_median(sizes.begin(), sizes.end()));
      x = solve(&residuals);
    }
    fit.gain = x[0];
    fit.offset_s += x[2];
    double squares = 0.0;
    std::vector<double> kept;
    for (const double r : residuals) {
      if (std::abs(r) > limit) continue;
      kept.push_back(r);
      squares += r * r;
    }
    fit.used = kept.size();
    fit.discarded = residuals.size() - kept.size();
    fit.residual_rms = std::sqrt(squares / static_cast<double>(kept.size()));
    const double variance = squares / std::max(1.0, static_cast<double>(kept.size()) - 3.0);
    fit.deviation_s = std::sqrt(variance * correlation_length(kept) * H.inverse()(2, 2));
    if (std::abs(x[2]) < 1e-7) break;
  }
  return fit;
}

}  // namespace perimap
