#include "core/calibration/pivot.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "core/angle/angle.hpp"
#include "core/calibration/residual_correlation.hpp"
#include "core/calibration/rotation_spread.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr std::size_t kFewestPoses = 10;
constexpr double kFewestSpread_deg = 3.0;  // about the second axis
// RMS of the poses about the tip: a tracker 1.4 mm and 0.5 degrees off has 3.5 mm with a tool of 40 cm.
constexpr double kLargestResidual_mm = 5.0;
constexpr double kLongestTool_mm = 1000.0;

struct Solution {
  Vector3d tip_T;
  Vector3d pivot_W;
  Eigen::Matrix<double, 6, 6> information;
};

// In the tool's frame: tip - R^T (pivot - t), mm.
Vector3d error_T(const TimedPose& pose, const Vector3d& tip_T, const Vector3d& pivot_W) {
  return tip_T - pose.X.R.transpose() * (pivot_W - pose.X.t);
}

// Variance per axis of the tracker's orientation noise, rad^2: what it makes of the tip lies across the arm alone.
double rotation_variance(const Matrix3d& error_covariance, const Vector3d& tip_T) {
  const double along = tip_T.dot(error_covariance * tip_T) / tip_T.squaredNorm();
  const double across = 0.5 * (error_covariance.trace() - along);
  return std::max(0.0, across - along) / tip_T.squaredNorm();
}

// What the noise of the orientations makes of the normal equations' sum J^T W e at the true tip, in which it stands in
// J and in e: without it the arm comes out too short where the tool hardly turned (errors in variables; Fuller 1987).
// Orientations exp([d]) off with d of variance s^2 per axis: E e = s^2 tip, and E [d] W e = s^2 sum_k [e_k] W [e_k]
// tip.
Vector6d orientation_bias(const std::vector<TimedPose>& poses, const std::vector<char>& used, const Matrix3d& W,
                          double variance, const Vector3d& tip_T) {
  Matrix3d turned = W;
  for (int k = 0; k < 3; ++k) turned += cross_matrix(Vector3d::Unit(k)) * W * cross_matrix(Vector3d::Unit(k));
  Vector6d bias = Vector6d::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (used[i] == 0) continue;
    bias.head<3>() += variance * (W * tip_T);
    bias.tail<3>() -= variance * (poses[i].X.R * (turned * tip_T));
  }
  return bias;
}

// Over the poses chosen, errors weighted by W in the tool's frame; `bias`: orientation_bias().
Solution solve(const std::vector<TimedPose>& poses, const std::vector<char>& used, const Matrix3d& W,
               const Vector6d& bias = Vector6d::Zero()) {
  Solution solution{Vector3d::Zero(), Vector3d::Zero(), Eigen::Matrix<double, 6, 6>::Zero()};
  Vector6d g = Vector6d::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (used[i] == 0) continue;
    const Pose& X = poses[i].X;
    Eigen::Matrix<double, 3, 6> J;
    J << Matrix3d::Identity(), -X.R.transpose();
    solution.information += J.transpose() * W * J;
    g -= J.transpose() * W * (X.R.transpose() * X.t);
  }
  const Vector6d x = solution.information.ldlt().solve(g + bias);
  solution.tip_T = x.head<3>();
  solution.pivot_W = x.tail<3>();
  return solution;
}

double rms(const std::vector<TimedPose>& poses, const std::vector<char>& used, const Solution& s, double* worst) {
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (used[i] == 0) continue;
    const double d = error_T(poses[i], s.tip_T, s.pivot_W).norm();
    squares += d * d, count += 1.0;
    if (worst != nullptr) *worst = std::max(*worst, d);
  }
  return std::sqrt(squares / std::max(1.0, count));
}

// The poses that agree with the point that has the least median distance, among the points of many small samples.
std::vector<char> agreeing(const std::vector<TimedPose>& poses) {
  constexpr int kSamples = 1000;
  constexpr std::size_t kSampleSize = 4;
  const std::vector<char> all(poses.size(), 1);
  std::mt19937 generator(1);  // the same poses give the same answer
  std::vector<double> distances(poses.size());
  double least = std::numeric_limits<double>::infinity();
  Solution best = solve(poses, all, Matrix3d::Identity());
  const auto consider = [&](const Solution& s) {
    for (std::size_t i = 0; i < poses.size(); ++i) distances[i] = error_T(poses[i], s.tip_T, s.pivot_W).norm();
    std::vector<double> sorted = distances;
    const double median = upper_median(sorted.begin(), sorted.end());
    if (median < least) least = median, best = s;
  };
  consider(best);
  for (int sample = 0; sample < kSamples; ++sample) {
    std::vector<char> chosen(poses.size(), 0);
    for (std::size_t k = 0; k < kSampleSize; ++k) chosen[generator() % poses.size()] = 1;
    const Solution s = solve(poses, chosen, Matrix3d::Identity());
    if (s.tip_T.allFinite() && s.tip_T.norm() < 1e5) consider(s);
  }
  // A Gaussian error in three dimensions has its median at 1.54 deviations of an axis, and one in 1000 beyond 4.03.
  const double limit = std::max(1e-9, 4.03 / 1.54 * (1.0 + 5.0 / static_cast<double>(poses.size())) * least);
  std::vector<char> used;
  for (const TimedPose& pose : poses) used.push_back(error_T(pose, best.tip_T, best.pivot_W).norm() <= limit ? 1 : 0);
  return used;
}

Matrix3d error_covariance(const std::vector<TimedPose>& poses, const std::vector<char>& used, const Solution& s) {
  Matrix3d sum = Matrix3d::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (used[i] == 0) continue;
    const Vector3d e = error_T(poses[i], s.tip_T, s.pivot_W);
    sum += e * e.transpose(), count += 1.0;
  }
  return sum / std::max(1.0, count - 2.0) + 1e-12 * Matrix3d::Identity();
}

double held_aside_rms(const std::vector<TimedPose>& poses, const std::vector<char>& used, const Matrix3d& W) {
  constexpr std::size_t kParts = 5;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t part = 0; part < kParts; ++part) {
    std::vector<char> fitted = used;
    for (std::size_t i = part; i < poses.size(); i += kParts) fitted[i] = 0;
    const Solution s = solve(poses, fitted, W);
    for (std::size_t i = part; i < poses.size(); i += kParts) {
      if (used[i] == 0) continue;
      squares += error_T(poses[i], s.tip_T, s.pivot_W).squaredNorm(), count += 1.0;
    }
  }
  return std::sqrt(squares / std::max(1.0, count));
}

}  // namespace

Expected<PivotCalibration> calibrate_pivot(const std::vector<TimedPose>& poses) {
  if (poses.size() < kFewestPoses) {
    return fail("too few poses: " + std::to_string(poses.size()) + ", and at least " + std::to_string(kFewestPoses) +
                " are needed; turn the tool about its resting tip for some seconds");
  }
  PivotCalibration result;
  std::vector<Matrix3d> rotations;
  for (const TimedPose& pose : poses) rotations.push_back(pose.X.R);
  const RotationSpread spread = rotation_spread(rotations);
  result.spread_deg = spread.deviation_rad / kDegree;
  if (result.spread_deg[1] < kFewestSpread_deg) {
    return fail("the tool turned about one axis only (" + std::to_string(static_cast<int>(result.spread_deg[0])) +
                " degrees of standard deviation about it, " + std::to_string(static_cast<int>(result.spread_deg[1])) +
                " about the next): swing it to all sides about its resting tip, 30 degrees and more");
  }
  const std::vector<char> all(poses.size(), 1);
  result.rms_all_mm = rms(poses, all, solve(poses, all, Matrix3d::Identity()), nullptr);
  result.used = agreeing(poses);
  const auto count = static_cast<std::size_t>(std::count(result.used.begin(), result.used.end(), 1));
  if (2 * count < poses.size() || count < kFewestPoses) {
    return fail("only " + std::to_string(count) + " of " + std::to_string(poses.size()) +
                " poses agree on a tip: it slipped; rest it in a dimple and record again");
  }
  Matrix3d W = Matrix3d::Identity();
  Solution s = solve(poses, result.used, W);
  for (int round = 0; round < 4; ++round) {
    const Matrix3d covariance = error_covariance(poses, result.used, s);
    W = covariance.inverse();
    const double variance = rotation_variance(covariance, s.tip_T);
    s = solve(poses, result.used, W, orientation_bias(poses, result.used, W, variance, s.tip_T));
  }
  result.tip_T = s.tip_T;
  result.pivot_W = s.pivot_W;
  result.rms_mm = rms(poses, result.used, s, &result.worst_mm);
  // A tip that slides leaves no pose out: the arm takes up what turning and sliding have in common, whatever its
  // length.
  const double length_mm = result.tip_T.norm();
  if (!(result.rms_mm <= kLargestResidual_mm) || !(length_mm <= kLongestTool_mm)) {
    return fail("the poses agree on no tip: they lie " + std::to_string(std::lround(std::min(1e9, result.rms_mm))) +
                " mm RMS about one " + std::to_string(std::lround(std::min(1e9, length_mm))) +
                " mm away, and within 5 mm RMS of one within 1000 mm was expected: it slid meanwhile; rest it in a "
                "dimple and record again");
  }
  result.held_aside_mm = held_aside_rms(poses, result.used, W);
  double length = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (result.used[i] != 0) along.push_back(error_T(poses[i], s.tip_T, s.pivot_W)[axis]);
    }
    length += correlation_length(along) / 3.0;
  }
  result.correlation_length = length;
  result.covariance_T = length * s.information.inverse().topLeftCorner<3, 3>();
  return result;
}

}  // namespace perimap
