#include "daemon/setup/hand_eye_judgement.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/statistics/upper_median.hpp"
#include "daemon/setup/hand_eye_adjustment.hpp"
#include "daemon/setup/opencv_hand_eye.hpp"

namespace perimap {
namespace {

struct PlaceErrors {
  double mm = 0.0;
  double deg = 0.0;
};

// Squares of the camera's place in the board's frame.
PlaceErrors place_error(const PosePair& pair, const Pose& X_SC, const Pose& X_WB) {
  const Pose predicted = X_WB.inverse() * pair.X_WS * X_SC;
  const double angle = so3_log(predicted.R.transpose() * pair.X_BC.R).norm() / kDegree;
  return {(predicted.t - pair.X_BC.t).squaredNorm(), angle * angle};
}

double median_or_none(std::vector<double> values) {
  return values.empty() ? 0.0 : upper_median(values.begin(), values.end());
}

// Indices of all pairs of poses about `interval_s` apart.
std::vector<std::pair<std::size_t, std::size_t>> apart_by(const std::vector<PosePair>& pairs, double interval_s,
                                                          double tolerance_s) {
  std::vector<std::pair<std::size_t, std::size_t>> found;
  std::size_t j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double wanted = pairs[i].t_s + interval_s;
    while (j + 1 < pairs.size() && std::abs(pairs[j + 1].t_s - wanted) <= std::abs(pairs[j].t_s - wanted)) ++j;
    if (j > i && std::abs(pairs[j].t_s - wanted) <= tolerance_s) found.emplace_back(i, j);
  }
  return found;
}

}  // namespace

void judge_held_aside(HandEyeCalibration& result) {
  constexpr std::size_t kParts = 5;
  const std::size_t n = result.pairs.size();
  double fitted = 0.0;
  PlaceErrors held;
  double count = 0.0;
  for (std::size_t part = 0; part < kParts; ++part) {
    // A part is a stretch of time, so that neighbours do not tell it.
    const auto is_held = [&](std::size_t i) { return i * kParts / n == part; };
    std::vector<char> others = result.used;
    for (std::size_t i = 0; i < n; ++i) others[i] = others[i] != 0 && !is_held(i) ? 1 : 0;
    const HandEyeAdjustment apart =
        adjust_hand_eye(result.pairs, others, result.X_SC, result.X_WB, result.error_covariance, false);
    for (std::size_t i = 0; i < n; ++i) {
      if (!is_held(i) || result.used[i] == 0) continue;
      const PlaceErrors e = place_error(result.pairs[i], apart.X_SC, apart.X_WB);
      held.mm += e.mm, held.deg += e.deg, count += 1.0;
      fitted += place_error(result.pairs[i], result.X_SC, result.X_WB).mm;
    }
  }
  result.fitted_rms_mm = std::sqrt(fitted / std::max(1.0, count));
  result.held_aside_rms_mm = std::sqrt(held.mm / std::max(1.0, count));
  result.held_aside_rms_deg = std::sqrt(held.deg / std::max(1.0, count));
}

void judge_motions(HandEyeCalibration& result, double camera_interval_s) {
  std::vector<std::pair<std::size_t, std::size_t>> apart;
  if (!result.paired_by_rows) {
    apart = apart_by(result.pairs, 1.0, std::max(0.005, std::min(0.25, 0.6 * camera_interval_s)));
  }
  if (apart.empty()) {
    // Poses at rest: each and the next.
    std::vector<double> intervals;
    for (std::size_t i = 1; i < result.pairs.size(); ++i) {
      apart.emplace_back(i - 1, i);
      intervals.push_back(result.pairs[i].t_s - result.pairs[i - 1].t_s);
    }
    result.disagreement_interval_s = median_or_none(intervals);
  }
  const auto all_of = [&](const Pose& X_SC) {
    std::vector<double> values;
    for (const auto& [i, j] : apart) values.push_back(motion_disagreement_mm(result.pairs[i], result.pairs[j], X_SC));
    return values;
  };
  result.disagreements_mm = all_of(result.X_SC);
  result.residual_median_mm = median_or_none(result.disagreements_mm);
  std::vector<double> distances;
  for (const double d : result.disagreements_mm) distances.push_back(std::abs(d - result.residual_median_mm));
  const double n = std::max(1.0, static_cast<double>(result.disagreements_mm.size()) / result.correlation_length);
  result.residual_median_mm_deviation = 1.2533 * 1.4826 * median_or_none(distances) / std::sqrt(n);
  result.others = opencv_hand_eyes(result.pairs);
  for (OtherHandEye& other : result.others) other.residual_median_mm = median_or_none(all_of(other.X_SC));
}

}  // namespace perimap
