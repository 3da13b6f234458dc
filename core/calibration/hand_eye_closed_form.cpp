#include "core/calibration/hand_eye_closed_form.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/angle/angle.hpp"
#include "core/geometry/nearest_rotation.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr std::size_t kMostMotions = 4000;

struct Motion {
  Pose A;          // of the sensor
  Pose B;          // of the camera
  Vector3d alpha;  // log of their rotations
  Vector3d beta;
};

// Motions between poses far enough apart in rotation that noise does not decide their axes; the largest there are where
// all are small. Of too many an even choice.
std::vector<Motion> motions_between(const std::vector<PosePair>& pairs) {
  const std::size_t n = pairs.size();
  std::vector<Motion> motions;
  // Steps through all (i, j) in an order that mixes short and long intervals; the same for the same number of poses.
  const std::size_t all = n * (n - 1) / 2;
  const std::size_t stride = std::max<std::size_t>(1, all / kMostMotions);
  std::size_t count = 0;
  for (std::size_t lag = 1; lag < n; ++lag) {
    for (std::size_t i = 0; i + lag < n; ++i, ++count) {
      if (count % stride != 0) continue;
      const PosePair& a = pairs[i];
      const PosePair& b = pairs[i + lag];
      Motion motion{a.X_WS.inverse() * b.X_WS, a.X_BC.inverse() * b.X_BC, {}, {}};
      motion.alpha = so3_log(motion.A.R);
      motion.beta = so3_log(motion.B.R);
      motions.push_back(motion);
    }
  }
  const auto angle = [](const Motion& m) { return std::min(m.alpha.norm(), m.beta.norm()); };
  const auto turns_enough = [&](const Motion& m) {
    return angle(m) > 10.0 * kDegree && std::max(m.alpha.norm(), m.beta.norm()) < 170.0 * kDegree;
  };
  std::vector<Motion> large;
  std::copy_if(motions.begin(), motions.end(), std::back_inserter(large), turns_enough);
  if (large.size() >= 20) return large;
  std::sort(motions.begin(), motions.end(), [&](const Motion& a, const Motion& b) { return angle(a) > angle(b); });
  motions.resize(std::min(motions.size(), std::max<std::size_t>(20, motions.size() / 3)));
  return motions;
}

// Which values are at most three robust deviations above zero.
std::vector<char> near_zero(const std::vector<double>& values) {
  std::vector<double> sorted = values;
  const double limit = std::max(1e-12, 3.0 * 1.4826 * upper_median(sorted.begin(), sorted.end()));
  std::vector<char> near;
  for (const double value : values) near.push_back(value <= limit ? 1 : 0);
  return near;
}

Matrix3d rotation_of(const std::vector<Motion>& motions) {
  std::vector<double> errors;
  for (const Motion& m : motions) errors.push_back(std::abs(m.alpha.norm() - m.beta.norm()));
  Matrix3d R = Matrix3d::Identity();
  for (int round = 0; round < 8; ++round) {
    const std::vector<char> used = near_zero(errors);
    Matrix3d M = Matrix3d::Zero();
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (used[i] != 0) M += motions[i].alpha * motions[i].beta.transpose();
    }
    R = nearest_rotation(M);
    for (std::size_t i = 0; i < motions.size(); ++i) errors[i] = (motions[i].alpha - R * motions[i].beta).norm();
  }
  return R;
}

Vector3d translation_of(const std::vector<Motion>& motions, const Matrix3d& R) {
  std::vector<double> errors(motions.size(), 0.0);
  Vector3d t = Vector3d::Zero();
  for (int round = 0; round < 8; ++round) {
    const std::vector<char> used = near_zero(errors);
    Matrix3d H = 1e-9 * Matrix3d::Identity();  // where nothing turns about a second axis the shortest is taken
    Vector3d g = Vector3d::Zero();
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (used[i] == 0) continue;
      const Matrix3d J = motions[i].A.R - Matrix3d::Identity();
      H += J.transpose() * J;
      g += J.transpose() * (R * motions[i].B.t - motions[i].A.t);
    }
    t = H.ldlt().solve(g);
    for (std::size_t i = 0; i < motions.size(); ++i) {
      const Motion& m = motions[i];
      errors[i] = (m.A.R * t + m.A.t - R * m.B.t - t).norm();
    }
  }
  return t;
}

Vector3d median_of(const std::vector<Vector3d>& values) {
  Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> coordinates;
    for (const Vector3d& value : values) coordinates.push_back(value[axis]);
    middle[axis] = upper_median(coordinates.begin(), coordinates.end());
  }
  return middle;
}

}  // namespace

std::optional<Pose> hand_eye_closed_form(const std::vector<PosePair>& pairs) {
  if (pairs.size() < 3) return std::nullopt;
  const std::vector<Motion> motions = motions_between(pairs);
  const bool turns = std::any_of(motions.begin(), motions.end(), [](const Motion& m) {
    return m.alpha.norm() > 0.1 * kDegree && m.beta.norm() > 0.1 * kDegree;
  });
  if (!turns) return std::nullopt;
  const Matrix3d R = rotation_of(motions);
  return Pose{R, translation_of(motions, R)};
}

Pose board_in_world(const std::vector<PosePair>& pairs, const Pose& X_SC) {
  std::vector<Pose> X_WB;
  for (const PosePair& pair : pairs) X_WB.push_back(pair.X_WS * X_SC * pair.X_BC.inverse());
  Matrix3d R = X_WB.front().R;
  for (int round = 0; round < 5; ++round) {
    std::vector<Vector3d> turns;
    for (const Pose& X : X_WB) turns.push_back(so3_log(R.transpose() * X.R));
    R = R * so3_exp(median_of(turns));
  }
  std::vector<Vector3d> places;
  for (const Pose& X : X_WB) places.push_back(X.t);
  return {R, median_of(places)};
}

Vector6d hand_eye_error(const PosePair& pair, const Pose& X_SC, const Pose& X_WB) noexcept {
  const Pose error = pair.X_WS.inverse() * X_WB * pair.X_BC * X_SC.inverse();
  Vector6d e;
  e << so3_log(error.R), error.t;
  return e;
}

double motion_disagreement_mm(const PosePair& first, const PosePair& second, const Pose& X_SC) noexcept {
  const Pose A = first.X_WS.inverse() * second.X_WS;
  const Pose B = first.X_BC.inverse() * second.X_BC;
  return ((A * X_SC).t - (X_SC * B).t).norm();
}

}  // namespace perimap
