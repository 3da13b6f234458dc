#include "core/calibration/motion_offset.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/calibration/variance_of_sum.hpp"

namespace perimap {
namespace {

// Each less the mean of those at most half a window away.
std::vector<Vector6d> without_slow(const std::vector<Vector6d>& values, const std::vector<double>& times_s,
                                   double window_s) {
  std::vector<Vector6d> fast;
  std::size_t begin = 0;
  std::size_t end = 0;
  Vector6d sum = Vector6d::Zero();
  for (std::size_t i = 0; i < values.size(); ++i) {
    while (end < values.size() && times_s[end] <= times_s[i] + 0.5 * window_s) sum += values[end++];
    while (times_s[begin] < times_s[i] - 0.5 * window_s) sum -= values[begin++];
    fast.emplace_back(values[i] - sum / static_cast<double>(end - begin));
  }
  return fast;
}

}  // namespace

std::optional<MotionOffset> offset_by_motion(const std::vector<PosePair>& pairs, const std::vector<Vector6d>& errors,
                                             const std::vector<char>& used,
                                             const Eigen::Matrix<double, 6, 6>& error_covariance, double window_s) {
  constexpr std::size_t kFewest = 20;
  const Eigen::Matrix<double, 6, 6> root = error_covariance.llt().matrixL();
  std::vector<double> times_s;
  std::vector<Vector6d> whitened;
  std::vector<Vector6d> twists;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (used[i] == 0) continue;
    times_s.push_back(pairs[i].t_s);
    whitened.emplace_back(root.triangularView<Eigen::Lower>().solve(errors[i]));
    twists.emplace_back(root.triangularView<Eigen::Lower>().solve(pairs[i].twist_S));
  }
  if (times_s.size() < kFewest) return std::nullopt;
  const std::vector<Vector6d> fast_errors = without_slow(whitened, times_s, window_s);
  const std::vector<Vector6d> fast_twists = without_slow(twists, times_s, window_s);
  double H = 0.0;
  double g = 0.0;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    H += fast_twists[i].squaredNorm();
    g += fast_twists[i].dot(fast_errors[i]);
  }
  if (!(H > 0.0)) return std::nullopt;
  MotionOffset result;
  result.change_s = -g / H;
  std::vector<double> scores;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    scores.push_back(fast_twists[i].dot(fast_errors[i] + result.change_s * fast_twists[i]));
  }
  // Never less than of white errors: of several windows the one whose deviation came out smallest by chance would be
  // taken for the surest.
  double alone = 0.0;
  for (const double score : scores) alone += score * score;
  result.deviation_s = std::sqrt(std::max(alone, variance_of_sum(scores))) / H;
  double all = 0.0;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    all += (fast_errors[i] + result.change_s * fast_twists[i]).squaredNorm();
  }
  result.white_deviation_s = std::sqrt(all / static_cast<double>(6 * times_s.size()) / H);
  return result;
}

}  // namespace perimap
