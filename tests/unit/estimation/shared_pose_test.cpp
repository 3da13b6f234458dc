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

// A linear Kalman filter with sightings whose pose errors are correlated, and what each error is worth in its estimate,
// written out.
struct CorrelatedSightings {
  static constexpr int kFrames = 12;
  static constexpr double kCorrelation_s = 0.15;
  static constexpr double kPeriod_s = 0.033;
  const BasisLayout layout{2, 0};
  const int d = layout.state_size();
  const Matrix6d sigma = Vector6d(1.0, 2.0, 0.5, 3.0, 1.5, 0.7).asDiagonal();
  StateMatrix P = 4.0 * StateMatrix::Identity(d, d);
  std::vector<PoseNoiseTerm> terms;    // M of the recursion's P
  std::vector<Eigen::MatrixXd> worth;  // de / ds of each frame
  CorrelatedPoseNoise recursive{d, kCorrelation_s};
  CorrelatedPoseNoise white{d, 0.0};

  explicit CorrelatedSightings(double process_variance) {
    std::mt19937 generator(8);
    std::normal_distribution<double> normal;
    const auto random = [&](int rows, int columns) {
      return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(generator); }));
    };
    for (int f = 0; f < kFrames; ++f) {
      PoseNoiseTerm term{basis_at(layout, 0.9 * f),       {},           random(2, 3),
                         Vector2d(1.0, 2.0).asDiagonal(), random(2, 6), sigma};
      Eigen::MatrixXd B = Eigen::MatrixXd::Zero(3, d);
      for (int axis = 0; axis < 3; ++axis) B.block(axis, axis * layout.size(), 1, layout.size()) = term.b.transpose();
      const Eigen::MatrixXd H = term.dz_dp * B;
      P += process_variance * StateMatrix::Identity(d, d);
      const Eigen::MatrixXd K = P * H.transpose() * Matrix2d(H * P * H.transpose() + term.R).inverse();
      const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(d, d) - K * H;
      P = left * Eigen::MatrixXd(P);
      for (Eigen::MatrixXd& earlier : worth) earlier = left * earlier;
      worth.emplace_back(K * term.dz_ds);
      term.M = position_gain(P, term.b);
      recursive.pass(kPeriod_s);
      recursive.add(term);
      white.pass(kPeriod_s);
      white.add(term);
      terms.push_back(term);
    }
  }

  [[nodiscard]] Eigen::MatrixXd expected() const {
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(d, d);
    for (std::size_t f = 0; f < worth.size(); ++f) {
      for (std::size_t g = 0; g < worth.size(); ++g) {
        const double apart_s = kPeriod_s * std::abs(static_cast<double>(f) - static_cast<double>(g));
        if (f != g) C += std::exp(-apart_s / kCorrelation_s) * worth[f] * sigma * worth[g].transpose();
      }
    }
    return C;
  }
};

TEST(CorrelatedPoseNoise, IsWhatThePoseErrorsOfDifferentFramesHaveInCommonInTheEstimate) {
  for (const double process_variance : {0.0, 0.05}) {
    const CorrelatedSightings sightings(process_variance);
    const Eigen::MatrixXd expected = sightings.expected();
    EXPECT_GT(expected.norm(), 0.1 * sightings.P.norm());
    EXPECT_LT((sightings.recursive.covariance() - expected).norm(), 1e-9 * expected.norm());
  }
}

TEST(CorrelatedPoseNoise, OfABatchIsThatOfTheRecursion) {
  const CorrelatedSightings sightings(0.0);
  CorrelatedPoseNoise batch(sightings.d, CorrelatedSightings::kCorrelation_s);
  for (PoseNoiseTerm term : sightings.terms) {
    term.M = position_gain(sightings.P, term.b);
    batch.pass(CorrelatedSightings::kPeriod_s);
    batch.add_of_batch(term);
  }
  const Eigen::MatrixXd expected = sightings.expected();
  EXPECT_LT((batch.covariance() - expected).norm(), 1e-9 * expected.norm());
}

TEST(CorrelatedPoseNoise, IsNothingWhereTheErrorIsWhite) {
  EXPECT_EQ(CorrelatedSightings(0.0).white.covariance().norm(), 0.0);
}

}  // namespace
}  // namespace perimap
