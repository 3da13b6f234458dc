#include "daemon/setup/lens_in_hand_eye.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "daemon/setup/hand_eye_adjustment.hpp"

namespace perimap {
namespace {

using Vector9d = Eigen::Matrix<double, 9, 1>;

// Changes of the lens, each of one standard deviation, that go together as its covariance has it.
std::vector<Vector9d> changes_of(const LensCovariance& covariance) {
  const Vector9d deviation = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Vector9d scale = deviation.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  const Eigen::SelfAdjointEigenSolver<LensCovariance> eigen(scale.asDiagonal() * covariance * scale.asDiagonal());
  std::vector<Vector9d> changes;
  for (int k = 0; k < 9; ++k) {
    const double variance = eigen.eigenvalues()[k];
    constexpr double kLeast = 1e-9;  // of correlations
    if (variance > kLeast)
      changes.emplace_back(std::sqrt(variance) * deviation.cwiseProduct(eigen.eigenvectors().col(k)));
  }
  return changes;
}

// About two a second.
std::vector<TimedView> thinned(const std::vector<TimedView>& views) {
  constexpr double kInterval_s = 0.5 - 1e-3;
  std::vector<TimedView> few;
  for (const TimedView& seen : views) {
    if (few.empty() || seen.t_s >= few.back().t_s + kInterval_s) few.push_back(seen);
  }
  return few;
}

// As measured through this lens by these views, the clocks' offset and what counts as noise being as they are.
std::optional<Pose> measured_through(const HandEyeCalibration& result, const std::vector<TimedView>& views,
                                     const CameraModel& lens) {
  std::vector<PosePair> pairs;
  std::vector<char> used;
  for (const TimedPose& seen : camera_poses_of(views, lens)) {
    const auto at = std::lower_bound(result.pairs.begin(), result.pairs.end(), seen.t_s,
                                     [](const PosePair& pair, double t_s) { return pair.t_s < t_s; });
    if (at == result.pairs.end() || at->t_s != seen.t_s) continue;
    const auto i = static_cast<std::size_t>(at - result.pairs.begin());
    pairs.push_back(*at);
    pairs.back().X_BC = seen.X;
    used.push_back(result.used[i]);
  }
  const HandEyeAdjustment adjusted =
      adjust_hand_eye(pairs, used, result.X_SC, result.X_WB, result.error_covariance, false);
  if (!adjusted.converged) return std::nullopt;
  return adjusted.X_SC;
}

}  // namespace

void add_lens_uncertainty(HandEyeCalibration& result, const std::vector<TimedView>& views, const CameraModel& lens,
                          const LensCovariance& covariance) {
  const std::vector<TimedView> few = thinned(views);
  const auto untold = [&](const char* why) { result.lens_untold = why; };
  const auto before = measured_through(result, few, lens);
  if (!before) return untold("two of its views a second do not determine the hand-eye");
  Eigen::Matrix<double, 7, 7> by_lens = Eigen::Matrix<double, 7, 7>::Zero();
  Eigen::Matrix<double, 6, 2> with_principal = Eigen::Matrix<double, 6, 2>::Zero();
  double at_target = 0.0;
  Vector2d middle_px;
  const Vector3d target_C(0.0, 0.0, HandEyeCalibration::kTargetAhead_mm);
  if (lens.project(target_C, middle_px) != ProjectionStatus::kOk) {
    return untold("the lens does not show what is straight ahead of it");
  }
  for (const Vector9d& change : changes_of(covariance)) {
    const CameraModel changed = changed_lens(lens, change);
    const auto after = measured_through(result, few, changed);
    Vector3d ray_C;
    if (!after || !changed.unproject(middle_px, ray_C)) {
      return untold("with the lens changed by one of its deviations the views do not determine the hand-eye");
    }
    const Pose by = before->inverse() * *after;
    Vector6d e;
    e << so3_log(by.R), by.t;
    by_lens.topLeftCorner<6, 6>() += e * e.transpose();
    with_principal += e * change.segment<2>(2).transpose();
    at_target += (by * (target_C.z() / ray_C.z() * ray_C) - target_C).squaredNorm();
  }
  result.covariance += by_lens;
  result.covariance_by_lens = by_lens;
  result.covariance_with_principal = with_principal;
  result.target_deviation_by_lens_mm = std::sqrt(at_target);
  result.lens_untold.clear();
}

}  // namespace perimap
