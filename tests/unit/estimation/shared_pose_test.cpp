#include "core/estimation/shared_pose.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

#include "core/estimation/correlated_pose_noise.hpp"
#include "core/estimation/iterated_update.hpp"
#include "simulated_feature.hpp"

namespace perimap {
namespace {

using test::kPixelDeviation;
using test::kPixelModel;

constexpr double kCentre_mm = 0.8;
constexpr double kRotation_rad = 0.005;

Vector3d normal3(std::mt19937& generator) {
  std::normal_distribution<double> normal;
  const double x = normal(generator);
  const double y = normal(generator);
  return {x, y, normal(generator)};
}

Pose moved(const Pose& X_CW, const Vector3d& theta, const Vector3d& delta_c) {
  const Vector3d c = -(X_CW.R.transpose() * X_CW.t) + delta_c;
  const Matrix3d R = so3_exp(theta) * X_CW.R;
  return {R, -(R * c)};
}

CommonInformation prior() {
  return tracker_prior(kRotation_rad * kRotation_rad * Matrix3d::Identity(),
                       kCentre_mm * kCentre_mm * Matrix3d::Identity());
}

// Features near the origin whose map is off by its own covariance, seen from a pose that the tracker gives wrongly.
struct Frame {
  Pose X_CW;  // the tracker's
  CommonVector s;
  std::vector<Vector3d> p_true;
  std::vector<CommonMatch> matches;
};

Frame simulate(std::mt19937& generator, int features, double map_mm) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Frame frame;
  const Pose X_CW_true = test::camera_pose(3.0 * uniform(generator), false, 1.0);
  frame.s.resize(kPoseUnknowns);
  frame.s << kRotation_rad * normal3(generator), kCentre_mm * normal3(generator);
  // s corrects the tracker's pose: undo it, the centre first.
  const Vector3d theta = frame.s.head<3>();
  const Vector3d delta_c = frame.s.tail<3>();
  frame.X_CW = moved(X_CW_true, -theta, -delta_c);
  for (int i = 0; i < features; ++i) {
    const double x = uniform(generator);
    const double y = uniform(generator);
    const Vector3d p(20.0 * x, 15.0 * y, 15.0 * uniform(generator));
    CommonMatch match;
    match.S = map_mm * map_mm * Vector3d(1.0, 1.5, 4.0).asDiagonal();
    match.p_WF = p + map_mm * Vector3d(1.0, std::sqrt(1.5), 2.0).cwiseProduct(normal3(generator));
    match.R = kPixelDeviation * kPixelDeviation * Matrix2d::Identity();
    match.D = AppendedMotion(3, 0);
    EXPECT_EQ(kPixelModel.predict(X_CW_true * p, match.z), ProjectionStatus::kOk);
    match.z += kPixelDeviation * normal3(generator).head<2>();
    frame.p_true.push_back(p);
    frame.matches.push_back(match);
  }
  return frame;
}

TEST(SharedPose, JacobianIsThatOfTheProjectionAndOfWhatIsAppended) {
  std::mt19937 generator(1);
  Frame frame = simulate(generator, 3, 0.1);
  CommonMatch match = frame.matches[1];
  match.D = Vector3d(30.0, -20.0, 45.0);
  const CommonEstimate at = solve_common(frame.X_CW, with_appended(prior(), 1e-4));
  ASSERT_TRUE(at.ok);
  const CommonTerm term = linearise(kPixelModel, at, match);
  ASSERT_TRUE(term.visible);
  constexpr double kStep = 1e-5;
  for (int j = 0; j < 7; ++j) {
    Vector2d z[2];
    for (int side = 0; side < 2; ++side) {
      Eigen::Matrix<double, 7, 1> s = Eigen::Matrix<double, 7, 1>::Zero();
      s(j) = side == 0 ? -kStep : kStep;
      const Pose X_CW = moved(frame.X_CW, s.head<3>(), s.segment<3>(3));
      const Vector3d p = match.p_WF + match.D * s.tail<1>();
      ASSERT_EQ(kPixelModel.predict(X_CW * p, z[side]), ProjectionStatus::kOk);
    }
    EXPECT_LT((term.J_s.col(j) - (z[1] - z[0]) / (2.0 * kStep)).norm(), 1e-5 * (1.0 + term.J_s.col(j).norm())) << j;
  }
}

TEST(SharedPose, FindsTheTrackersErrorInAKnownMap) {
  std::mt19937 generator(2);
  Frame frame = simulate(generator, 30, 1e-6);
  for (std::size_t k = 0; k < frame.matches.size(); ++k) {
    const Pose X_CW = moved(frame.X_CW, frame.s.head<3>(), frame.s.tail<3>());
    ASSERT_EQ(kPixelModel.predict(X_CW * frame.matches[k].p_WF, frame.matches[k].z), ProjectionStatus::kOk);
    frame.matches[k].R *= 1e-6;
  }
  const SharedPose shared = estimate_shared_pose(kPixelModel, frame.X_CW, prior(), frame.matches);
  ASSERT_TRUE(shared.estimate.ok);
  EXPECT_LT((shared.estimate.s - frame.s).norm(), 1e-4);
}

TEST(SharedPose, GrossOutliersAreLeftOut) {
  std::mt19937 generator(3);
  for (int trial = 0; trial < 50; ++trial) {
    Frame frame = simulate(generator, 20, 0.1);
    for (const std::size_t k : {3U, 7U, 12U}) frame.matches[k].z += 60.0 * normal3(generator).head<2>().normalized();
    std::vector<std::uint8_t> used(frame.matches.size());
    const SharedPose shared = estimate_shared_pose(kPixelModel, frame.X_CW, prior(), frame.matches, used);
    ASSERT_TRUE(shared.estimate.ok);
    for (const std::size_t k : {3U, 7U, 12U}) EXPECT_EQ(used[k], 0);
    EXPECT_GE(shared.used, 16);
    EXPECT_LT((shared.estimate.s.tail<3>() - frame.s.tail<3>()).norm(), 1.5);
  }
}

TEST(SharedPose, TheOthersAloneSayWhatASolutionWithoutTheFeatureSays) {
  std::mt19937 generator(4);
  const Frame frame = simulate(generator, 12, 0.5);
  std::vector<std::uint8_t> used(frame.matches.size());
  const SharedPose shared = estimate_shared_pose(kPixelModel, frame.X_CW, prior(), frame.matches, used);
  ASSERT_TRUE(shared.estimate.ok);
  for (std::size_t own = 0; own < frame.matches.size(); ++own) {
    if (used[own] == 0) continue;
    CommonInformation others = prior();
    for (std::size_t k = 0; k < frame.matches.size(); ++k) {
      if (k != own && used[k] != 0)
        others += linearise(kPixelModel, shared.linearised_at, frame.matches[k]).information;
    }
    const CommonEstimate expected = solve_common(frame.X_CW, others);
    const CommonEstimate actual = what_others_say(kPixelModel, shared, frame.X_CW, frame.matches[own]);
    ASSERT_TRUE(expected.ok && actual.ok);
    EXPECT_LT((expected.s - actual.s).norm(), 1e-9);
    EXPECT_LT((expected.covariance - actual.covariance).norm(), 1e-9);
  }
}

TEST(SharedPose, SumsOfGroupsOnOtherThreadsGiveTheSameBits) {
  std::mt19937 generator(5);
  const Frame frame = simulate(generator, 21, 0.5);
  std::vector<std::uint8_t> used(frame.matches.size());
  const SharedPose shared = estimate_shared_pose(kPixelModel, frame.X_CW, prior(), frame.matches, used);
  CommonInformation sum = prior();
  for (std::size_t begin = 0; begin < frame.matches.size(); begin += kCommonGroup) {
    CommonInformation group = CommonInformation::zero(kPoseUnknowns);
    for (std::size_t k = begin; k < std::min(begin + kCommonGroup, frame.matches.size()); ++k) {
      if (used[k] != 0) group += linearise(kPixelModel, shared.linearised_at, frame.matches[k]).information;
    }
    sum += group;
  }
  EXPECT_EQ(sum.Lambda, shared.information.Lambda);
  EXPECT_EQ(solve_common(frame.X_CW, sum).s, shared.estimate.s);
}

// A map whose features err independently: pose and features must be as uncertain as they say. Counting the own match
// twice makes the feature surer than it may be.
TEST(SharedPose, IsConsistentWhenNoMatchCountsTwice) {
  std::mt19937 generator(6);
  constexpr int kTrials = 1500;
  double pose_nees = 0.0;
  double others_nees = 0.0;
  double naive_nees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Frame frame = simulate(generator, 6, 0.6);
    SharedPoseSettings no_gate;
    no_gate.gate = 1e9;
    const SharedPose shared = estimate_shared_pose(kPixelModel, frame.X_CW, prior(), frame.matches, {}, no_gate);
    ASSERT_TRUE(shared.estimate.ok);
    const CommonVector error = shared.estimate.s - frame.s;
    pose_nees += error.dot(shared.estimate.covariance.llt().solve(error)) / 6.0;
    const CommonMatch& own = frame.matches[0];
    const auto nees_with = [&](const CommonEstimate& pose) {
      FeatureEstimate feature{own.p_WF, own.S};
      const CommonTerm term = linearise(kPixelModel, pose, own);
      UpdateSettings update;
      update.gate = 1e9;
      iterated_update(feature, {own.z, own.R + common_noise(term.J_s, pose.covariance), Basis::Ones(1), pose.X_CW},
                      kPixelModel, update);
      const Vector3d off = feature.x - frame.p_true[0];
      return off.dot(Matrix3d(feature.P).llt().solve(off)) / 3.0;
    };
    others_nees += nees_with(what_others_say(kPixelModel, shared, frame.X_CW, own));
    naive_nees += nees_with(shared.estimate);
  }
  EXPECT_NEAR(pose_nees / kTrials, 1.0, 0.06);
  EXPECT_NEAR(others_nees / kTrials, 1.0, 0.08);
  EXPECT_GT(naive_nees / kTrials, 1.15);
}

TEST(SharedPose, SaysWhenThereIsNoSolution) {
  std::mt19937 generator(7);
  Frame frame = simulate(generator, 10, 0.5);
  EXPECT_FALSE(estimate_shared_pose(kPixelModel, frame.X_CW, CommonInformation::zero(kPoseUnknowns), {}).estimate.ok);
  // A match that is not a number, or behind the camera, is none.
  frame.matches[2].z.x() = std::nan("");
  frame.matches[5].p_WF = frame.X_CW.inverse() * Vector3d(0.0, 0.0, -50.0);
  std::vector<std::uint8_t> used(frame.matches.size());
  const SharedPose shared = estimate_shared_pose(kPixelModel, frame.X_CW, prior(), frame.matches, used);
  EXPECT_TRUE(shared.estimate.ok);
  EXPECT_EQ(used[2], 0);
  EXPECT_EQ(used[5], 0);
}

TEST(CorrelatedPoseNoise, IsTheCovarianceOfTheWeightedMeanUnderCorrelatedNoise) {
  std::mt19937 generator(8);
  std::normal_distribution<double> normal;
  const BasisLayout layout{2, 0};
  const int d = layout.state_size();
  constexpr int kFrames = 12;
  constexpr double kKept = 0.8;
  const Matrix6d sigma = Vector6d(1.0, 2.0, 0.5, 3.0, 1.5, 0.7).asDiagonal();
  CorrelatedPoseNoise noise(d);
  CorrelatedPoseNoise white(d);
  std::vector<Eigen::MatrixXd> A;
  const auto random = [&](int rows, int columns) {
    Eigen::MatrixXd m(rows, columns);
    for (int i = 0; i < m.size(); ++i) m(i) = normal(generator);
    return m;
  };
  for (int f = 0; f < kFrames; ++f) {
    const Basis b = basis_at(layout, 0.9 * f);
    const Matrix23d J = random(2, 3);
    const Matrix26d J_s = random(2, 6);
    const Matrix2d R = Vector2d(1.0, 2.0).asDiagonal();
    noise.add(b, J, R, J_s, sigma, kKept);
    white.add(b, J, R, J_s, sigma, 0.0);
    Eigen::MatrixXd B = Eigen::MatrixXd::Zero(3, d);
    for (int axis = 0; axis < 3; ++axis) B.block(axis, axis * layout.size(), 1, layout.size()) = b.transpose();
    A.emplace_back((J * B).transpose() * R.inverse() * J_s);
  }
  Eigen::MatrixXd V = Eigen::MatrixXd::Zero(d, d);
  for (int f = 0; f < kFrames; ++f) {
    for (int g = 0; g < kFrames; ++g) {
      const std::size_t i = static_cast<std::size_t>(f);
      const std::size_t j = static_cast<std::size_t>(g);
      if (f != g) V += std::pow(kKept, std::abs(f - g)) * A[i] * sigma * A[j].transpose();
    }
  }
  const Eigen::MatrixXd root = random(d, d);
  const StateMatrix P = root * root.transpose();
  const Eigen::MatrixXd expected = P + P * V * P;
  EXPECT_LT((noise.enlarged(P) - expected).norm(), 1e-9 * expected.norm());
  EXPECT_EQ(white.enlarged(P), P);
}

}  // namespace
}  // namespace perimap
