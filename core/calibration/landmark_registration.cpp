#include "core/calibration/landmark_registration.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/calibration/one_decimal.hpp"
#include "core/geometry/nearest_rotation.hpp"

namespace perimap {
namespace {

Vector3d mean_of(const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

struct Axes {
  Vector3d middle;
  Vector3d deviations;  // of the points along the axes, smallest first
  Matrix3d directions;  // columns
};

Axes principal_axes(const std::vector<Landmark>& landmarks) {
  std::vector<Vector3d> points;
  for (const Landmark& landmark : landmarks) points.push_back(landmark.p_I);
  Axes axes;
  axes.middle = mean_of(points);
  Matrix3d scatter = Matrix3d::Zero();
  for (const Vector3d& p : points) scatter += (p - axes.middle) * (p - axes.middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter / static_cast<double>(points.size()));
  axes.deviations = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  axes.directions = eigen.eigenvectors();
  return axes;
}

Pose fit(const std::vector<Landmark>& landmarks, std::optional<std::size_t> without) {
  std::vector<Vector3d> to;
  std::vector<Vector3d> from;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (i == without) continue;
    to.push_back(landmarks[i].p_I);
    from.push_back(landmarks[i].p_W);
  }
  return rigid_fit(to, from);
}

double distance_mm(const Landmark& landmark, const Pose& X_IW) { return (landmark.p_I - X_IW * landmark.p_W).norm(); }

// The landmark whose absence lets the others agree, when none agrees with all.
std::optional<Error> other_point_touched(const std::vector<Landmark>& landmarks, double tolerance_mm) {
  const std::size_t n = landmarks.size();
  const Pose all = fit(landmarks, std::nullopt);
  double worst = 0.0;
  for (const Landmark& landmark : landmarks) worst = std::max(worst, distance_mm(landmark, all));
  if (worst <= tolerance_mm) return std::nullopt;
  if (n < 5) {
    // With four landmarks three are left, which always agree well enough to point at nobody.
    return Error{"the landmarks do not fit: the worst is off by " + one_decimal(worst) +
                 " mm; was another point touched? Touch them again, or five and more, so that it can be told which"};
  }
  std::size_t odd = 0;
  double least = -1.0;
  for (std::size_t i = 0; i < n; ++i) {
    const Pose X = fit(landmarks, i);
    double squares = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      if (k != i) squares += std::pow(distance_mm(landmarks[k], X), 2);
    }
    if (least < 0.0 || squares < least) least = squares, odd = i;
  }
  const double off = distance_mm(landmarks[odd], fit(landmarks, odd));
  return Error{"landmark '" + landmarks[odd].name + "' is " + one_decimal(off) +
               " mm from where the others have it: another point was touched, or its name is wrong; touch it again"};
}

}  // namespace

Pose rigid_fit(const std::vector<Vector3d>& to, const std::vector<Vector3d>& from) {
  const Vector3d mean_to = mean_of(to);
  const Vector3d mean_from = mean_of(from);
  Matrix3d M = Matrix3d::Zero();
  for (std::size_t i = 0; i < to.size(); ++i) M += (to[i] - mean_to) * (from[i] - mean_from).transpose();
  const Matrix3d R = nearest_rotation(M);
  return {R, mean_to - R * mean_from};
}

Expected<LandmarkRegistration> register_landmarks(const std::vector<Landmark>& landmarks, double tolerance_mm) {
  const std::size_t n = landmarks.size();
  if (n < 3) {
    return fail("too few landmarks: " + std::to_string(n) +
                ", and at least 3 are needed, better 6; touch more of them");
  }
  const Axes axes = principal_axes(landmarks);
  if (axes.deviations[1] < std::max(1.0, 0.05 * axes.deviations[2])) {
    return fail("the landmarks lie on a line (" + one_decimal(axes.deviations[1]) +
                " mm of standard deviation beside it), so the turn about it is not known; touch one beside that line");
  }
  if (auto odd = other_point_touched(landmarks, tolerance_mm)) return tl::unexpected(*std::move(odd));
  LandmarkRegistration result;
  result.X_IW = fit(landmarks, std::nullopt);
  double squares = 0.0;
  for (const Landmark& landmark : landmarks) {
    result.residuals_mm.push_back(distance_mm(landmark, result.X_IW));
    squares += std::pow(result.residuals_mm.back(), 2);
  }
  result.fre_mm = std::sqrt(squares / static_cast<double>(n));
  // <FRE^2> = (1 - 2/N) <FLE^2> (Sibson 1979; equation 10 of Fitzpatrick et al.)
  result.fle_mm = n > 3 ? result.fre_mm / std::sqrt(1.0 - 2.0 / static_cast<double>(n)) : 0.0;
  if (n > 3) {
    for (std::size_t i = 0; i < n; ++i) result.held_aside_mm.push_back(distance_mm(landmarks[i], fit(landmarks, i)));
  }
  result.middle_I = axes.middle;
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  for (const Landmark& landmark : landmarks) {
    Eigen::Matrix<double, 3, 6> J;
    J << -cross_matrix(landmark.p_I - axes.middle), Matrix3d::Identity();
    information += J.transpose() * J;
  }
  result.covariance = result.fle_mm * result.fle_mm / 3.0 * information.inverse();
  return result;
}

double expected_target_error_mm(const std::vector<Landmark>& landmarks, const Vector3d& target_I, double fle_mm) {
  const Axes axes = principal_axes(landmarks);
  const double n = static_cast<double>(landmarks.size());
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const Vector3d along = axes.directions.col(k);
    const auto beside = [&](const Vector3d& p) {
      const Vector3d q = p - axes.middle;
      return (q - q.dot(along) * along).squaredNorm();
    };
    double f2 = 0.0;
    for (const Landmark& landmark : landmarks) f2 += beside(landmark.p_I) / n;
    sum += beside(target_I) / f2;
  }
  return fle_mm * std::sqrt((1.0 + sum / 3.0) / n);
}

}  // namespace perimap
