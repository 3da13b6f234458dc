// The closed forms and statistics of core/calibration, over seeded trials.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/angle/angle.hpp"
#include "core/calibration/brisk_speed.hpp"
#include "core/calibration/hand_eye_closed_form.hpp"
#include "core/calibration/landmark_registration.hpp"
#include "core/calibration/pivot.hpp"
#include "core/calibration/residual_correlation.hpp"
#include "core/calibration/rotation_spread.hpp"
#include "core/calibration/time_correlation.hpp"
#include "core/calibration/touched_landmarks.hpp"
#include "core/calibration/tracker_noise.hpp"

namespace perimap {
namespace {

using testing::HasSubstr;

class Draw {
 public:
  explicit Draw(unsigned seed) : generator_(seed) {}
  double normal(double deviation) { return deviation * normal_(generator_); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  Vector3d vector(double deviation) { return {normal(deviation), normal(deviation), normal(deviation)}; }
  Matrix3d rotation() { return so3_exp(vector(2.0)); }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
};

TEST(PoseAt, InterpolatesAndTellsTheTwist) {
  const Pose X_1{so3_exp({0.0, 0.0, 0.2}), {10.0, 0.0, 0.0}};
  const std::vector<TimedPose> poses{{1.0, {}}, {1.1, X_1}};
  const auto at = pose_at(poses, 1.05, 0.2);
  ASSERT_TRUE(at);
  EXPECT_NEAR(so3_log(at->X.R).z(), 0.1, 1e-12);
  EXPECT_NEAR(at->X.t.x(), 5.0, 1e-12);
  EXPECT_NEAR(at->twist[2], 2.0, 1e-9);
  EXPECT_NEAR(at->twist.tail<3>().norm(), 100.0, 1e-9);
}

TEST(PoseAt, GivesNothingOutsideAndInGapsButAtTheirEnds) {
  const std::vector<TimedPose> poses{{1.0, {}}, {2.0, {}}};
  EXPECT_FALSE(pose_at(poses, 0.9, 2.0));
  EXPECT_FALSE(pose_at(poses, 2.1, 2.0));
  EXPECT_FALSE(pose_at(poses, 1.5, 0.1));
  EXPECT_TRUE(pose_at(poses, 1.0, 0.1));
  EXPECT_TRUE(pose_at(poses, 2.0, 0.1));
}

std::vector<PosePair> exact_pairs(Draw& draw, const Pose& X_SC, std::size_t count) {
  const Pose X_WB{draw.rotation(), draw.vector(500.0)};
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    const Pose X_WS{draw.rotation(), draw.vector(100.0)};
    pairs.push_back({static_cast<double>(i), X_WS, X_WB.inverse() * X_WS * X_SC, Vector6d::Zero()});
  }
  return pairs;
}

TEST(HandEyeClosedForm, FindsTheTransformOfExactPoses) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Draw draw(seed);
    const Pose X_SC{draw.rotation(), draw.vector(100.0)};
    const auto pairs = exact_pairs(draw, X_SC, 10);
    const auto found = hand_eye_closed_form(pairs);
    ASSERT_TRUE(found);
    EXPECT_LT(so3_log(found->R.transpose() * X_SC.R).norm(), 1e-7);
    EXPECT_LT((found->t - X_SC.t).norm(), 1e-5);
  }
}

TEST(HandEyeClosedForm, IsNotMovedByOneInFiveWrongPoses) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Draw draw(seed);
    const Pose X_SC{draw.rotation(), draw.vector(100.0)};
    auto pairs = exact_pairs(draw, X_SC, 40);
    for (std::size_t i = 0; i < pairs.size(); i += 5) pairs[i].X_BC = {draw.rotation(), draw.vector(300.0)};
    const auto found = hand_eye_closed_form(pairs);
    ASSERT_TRUE(found);
    EXPECT_LT(so3_log(found->R.transpose() * X_SC.R).norm(), 0.01) << seed;
    EXPECT_LT((found->t - X_SC.t).norm(), 1.0) << seed;
  }
}

TEST(HandEyeClosedForm, NeedsRotation) {
  std::vector<PosePair> pairs(10);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].X_WS.t.x() = pairs[i].X_BC.t.x() = static_cast<double>(i);
  EXPECT_FALSE(hand_eye_closed_form(pairs));
}

TEST(MotionDisagreement, IsZeroForExactPoses) {
  Draw draw(3);
  const Pose X_SC{draw.rotation(), draw.vector(100.0)};
  const auto pairs = exact_pairs(draw, X_SC, 2);
  EXPECT_NEAR(motion_disagreement_mm(pairs[0], pairs[1], X_SC), 0.0, 1e-9);
}

TEST(RotationSpread, TellsTheAxesOfAMotion) {
  std::vector<Matrix3d> rotations;
  for (int i = -20; i <= 20; ++i) rotations.push_back(so3_exp({0.0, 0.02 * i, 0.0}));
  const RotationSpread spread = rotation_spread(rotations);
  EXPECT_NEAR(spread.deviation_rad[0], 0.02 * std::sqrt(140.0), 1e-6);
  EXPECT_NEAR(spread.deviation_rad[1], 0.0, 1e-9);
  EXPECT_NEAR(std::abs(spread.axes(1, 0)), 1.0, 1e-9);
}

std::vector<TimedValue> smooth_noise(unsigned seed, double begin_s, double end_s, double interval_s, double shift_s) {
  // Sines of many periods, the same for the same seed.
  Draw draw(seed);
  std::vector<std::array<double, 3>> waves;
  for (int i = 0; i < 12; ++i) waves.push_back({draw.normal(1.0), draw.uniform(0.2, 1.5), draw.uniform(0.0, 6.28)});
  std::vector<TimedValue> signal;
  for (double t = begin_s; t < end_s; t += interval_s) {
    double value = 0.0;
    for (const auto& [a, f, p] : waves) value += a * std::sin(2.0 * std::numbers::pi * f * (t - shift_s) + p);
    signal.push_back({t, value});
  }
  return signal;
}

TEST(Correlate, FindsAnOffsetWithItsSign) {
  const auto first = at_even_times(smooth_noise(1, 0.0, 30.0, 0.01, 0.25), 0.01, 0.1);
  const auto second = at_even_times(smooth_noise(1, 3.0, 28.0, 0.01, 0.0), 0.01, 0.1);
  const auto found = correlate(first, second, 1.0, 5.0, false);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.25, 0.002);
  EXPECT_GT(found->correlation, 0.99);
}

TEST(Correlate, GivesNothingWithoutOverlap) {
  const auto first = at_even_times(smooth_noise(1, 0.0, 10.0, 0.01, 0.0), 0.01, 0.1);
  const auto second = at_even_times(smooth_noise(1, 50.0, 60.0, 0.01, 0.0), 0.01, 0.1);
  EXPECT_FALSE(correlate(first, second, 1.0, 5.0, false));
}

TEST(FitOffset, IsWithinItsDeviation) {
  double nees = 0.0;
  constexpr unsigned kTrials = 100;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Draw draw(1000 + seed);
    auto first = smooth_noise(seed, 0.0, 30.0, 0.05, 0.06);
    const auto second = smooth_noise(seed, 0.0, 30.0, 0.01, 0.0);
    for (TimedValue& v : first) v.value = -3.0 * v.value + 7.0 + draw.normal(0.5);
    const auto fitted = fit_offset(first, second, 0.05, 0.1);
    ASSERT_TRUE(fitted);
    EXPECT_NEAR(fitted->gain, -3.0, 0.1);
    nees += std::pow((fitted->offset_s - 0.06) / fitted->deviation_s, 2) / kTrials;
  }
  EXPECT_GT(nees, 0.7);
  EXPECT_LT(nees, 1.4);
}

TEST(CorrelationLength, IsOneForWhiteAndMoreForSlowResiduals) {
  Draw draw(7);
  std::vector<double> white;
  std::vector<double> slow;
  double x = 0.0;
  for (int i = 0; i < 4000; ++i) {
    white.push_back(draw.normal(1.0));
    x = 0.9 * x + draw.normal(1.0);
    slow.push_back(x);
  }
  EXPECT_NEAR(correlation_length(white), 1.0, 0.1);
  EXPECT_NEAR(correlation_length(slow), 19.0, 5.0);  // (1 + rho) / (1 - rho)
}

std::vector<TimedPose> pivoting(Draw& draw, const Vector3d& tip_T, std::size_t count, double mm, double deg) {
  const Vector3d pivot_W = draw.vector(500.0);
  std::vector<TimedPose> poses;
  for (std::size_t i = 0; i < count; ++i) {
    Pose X;
    X.R = so3_exp(draw.vector(0.4));
    X.t = pivot_W - X.R * tip_T;
    X.t += draw.vector(mm / std::sqrt(3.0));
    X.R = X.R * so3_exp(draw.vector(deg * kDegree / std::sqrt(3.0)));
    poses.push_back({0.05 * static_cast<double>(i), X});
  }
  return poses;
}

TEST(Pivot, FindsTheTipWithinItsDeviation) {
  const Vector3d tip_T(3.0, -2.0, 150.0);
  double nees = 0.0;
  constexpr unsigned kTrials = 50;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Draw draw(seed);
    const auto result = calibrate_pivot(pivoting(draw, tip_T, 400, 1.4, 0.5));
    ASSERT_TRUE(result) << result.error().message;
    const Vector3d e = result->tip_T - tip_T;
    EXPECT_LT(e.norm(), 0.7) << seed;
    nees += e.dot(result->covariance_T.inverse() * e) / 3.0 / kTrials;
  }
  EXPECT_GT(nees, 0.75);
  EXPECT_LT(nees, 1.35);
}

TEST(Pivot, LeavesOutWhatSlipped) {
  Draw draw(5);
  const Vector3d tip_T(0.0, 0.0, 120.0);
  auto poses = pivoting(draw, tip_T, 200, 0.5, 0.1);
  for (std::size_t i = 0; i < poses.size(); i += 6) poses[i].X.t += draw.vector(20.0);
  const auto result = calibrate_pivot(poses);
  ASSERT_TRUE(result);
  EXPECT_LT((result->tip_T - tip_T).norm(), 0.4);
  EXPECT_GT(result->rms_all_mm, 5.0);
  EXPECT_LT(result->rms_mm, 1.0);
}

TEST(Pivot, RefusesAMotionAboutOneAxis) {
  Draw draw(6);
  std::vector<TimedPose> poses;
  for (int i = 0; i < 100; ++i) {
    Pose X;
    X.R = so3_exp({0.02 * i, 0.0, 0.0});
    X.t = -(X.R * Vector3d(0.0, 0.0, 100.0)) + draw.vector(0.1);
    poses.push_back({0.1 * i, X});
  }
  const auto result = calibrate_pivot(poses);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("one axis only"));
}

// It leaves no pose out: the arm takes up what turning and sliding have in common.
TEST(Pivot, RefusesATipThatSlides) {
  for (const double mm_per_s : {2.0, 5.0, 20.0}) {
    Draw draw(8);
    auto poses = pivoting(draw, {0.0, 10.0, 120.0}, 400, 0.3, 0.1);
    for (TimedPose& pose : poses) pose.X.t.x() += mm_per_s * pose.t_s;
    const auto result = calibrate_pivot(poses);
    ASSERT_FALSE(result) << mm_per_s;
    EXPECT_THAT(result.error().message, HasSubstr("slid")) << mm_per_s;
  }
}

std::vector<Landmark> landmarks_of(Draw& draw, std::size_t count, double fle_mm) {
  const Pose X_IW{draw.rotation(), draw.vector(300.0)};
  std::vector<Landmark> landmarks;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d p_W = draw.vector(60.0);
    landmarks.push_back({"L" + std::to_string(i), X_IW * p_W + draw.vector(fle_mm / std::sqrt(3.0)), p_W});
  }
  return landmarks;
}

TEST(Registration, FindsAnExactTransform) {
  Draw draw(9);
  const auto landmarks = landmarks_of(draw, 5, 0.0);
  const auto result = register_landmarks(landmarks, 5.0);
  ASSERT_TRUE(result);
  for (const Landmark& landmark : landmarks) EXPECT_LT((result->X_IW * landmark.p_W - landmark.p_I).norm(), 1e-9);
}

TEST(Registration, TellsTheErrorOfATargetAsFitzpatrickDoes) {
  // Over many trials of one layout: the mean square error at a target is what the formula says.
  Draw layout(11);
  const auto exact = landmarks_of(layout, 6, 0.0);
  const auto truth = register_landmarks(exact, 5.0)->X_IW;
  const Vector3d target_I = exact[0].p_I + Vector3d(80.0, 40.0, -30.0);
  double squares = 0.0;
  constexpr int kTrials = 3000;
  for (int trial = 0; trial < kTrials; ++trial) {
    auto landmarks = exact;
    for (Landmark& landmark : landmarks) landmark.p_W += layout.vector(1.0 / std::sqrt(3.0));
    const auto result = register_landmarks(landmarks, 50.0);
    squares += (result->X_IW * (truth.inverse() * target_I) - target_I).squaredNorm() / kTrials;
  }
  EXPECT_NEAR(std::sqrt(squares) / expected_target_error_mm(exact, target_I, 1.0), 1.0, 0.05);
}

TEST(Registration, RefusesTooFewLandmarksAndALine) {
  Draw draw(12);
  EXPECT_THAT(register_landmarks(landmarks_of(draw, 2, 0.0), 5.0).error().message, HasSubstr("too few landmarks"));
  std::vector<Landmark> line;
  for (int i = 0; i < 5; ++i) line.push_back({"L", Vector3d(20.0 * i, 0.0, 0.0), Vector3d(0.0, 20.0 * i, 0.0)});
  EXPECT_THAT(register_landmarks(line, 5.0).error().message, HasSubstr("on a line"));
}

TEST(Registration, NamesTheLandmarkThatIsAnotherPoint) {
  Draw draw(13);
  auto landmarks = landmarks_of(draw, 6, 1.0);
  landmarks[3].p_W += Vector3d(30.0, 0.0, 0.0);
  const auto result = register_landmarks(landmarks, 10.0);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("'L3'"));
}

std::vector<TimedPose> held_still(Draw& draw, double mm, double deg, double correlation_s, double seconds) {
  std::vector<TimedPose> poses;
  constexpr double kInterval_s = 1.0 / 60.0;
  const double rho = correlation_s > 0.0 ? std::exp(-kInterval_s / correlation_s) : 0.0;
  Vector3d place = draw.vector(mm / std::sqrt(3.0));
  Vector3d turn = draw.vector(deg * kDegree / std::sqrt(3.0));
  const Pose X{draw.rotation(), {100.0, 200.0, -1500.0}};
  for (double t = 0.0; t < seconds; t += kInterval_s) {
    const double fresh = std::sqrt(1.0 - rho * rho);
    place = rho * place + draw.vector(fresh * mm / std::sqrt(3.0));
    turn = rho * turn + draw.vector(fresh * deg * kDegree / std::sqrt(3.0));
    poses.push_back({t, {X.R * so3_exp(turn), X.t + place}});
  }
  return poses;
}

TEST(TrackerNoise, IsMeasuredWhiteAndSlow) {
  for (const double correlation_s : {0.0, 0.1, 0.5}) {
    for (unsigned seed = 0; seed < 5; ++seed) {
      Draw draw(seed);
      const auto noise = measure_tracker_noise(held_still(draw, 1.4, 0.5, correlation_s, 60.0));
      ASSERT_TRUE(noise) << noise.error().message;
      EXPECT_NEAR(noise->position_deviation_mm, 1.4, 0.21) << correlation_s << " " << seed;
      EXPECT_NEAR(noise->rotation_deviation_deg, 0.5, 0.075) << correlation_s << " " << seed;
      if (correlation_s == 0.0) {
        EXPECT_LT(noise->correlation_s, 1.0 / 60.0);
      } else {
        EXPECT_GT(noise->correlation_s, 0.5 * correlation_s) << seed;
        EXPECT_LT(noise->correlation_s, 2.0 * correlation_s) << seed;
      }
    }
  }
}

// Of an error that lasts for minutes half a minute shows a small part: more than that must not be said.
TEST(TrackerNoise, OfADriftSaysThatItIsNotKnown) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    Draw draw(seed);
    const auto noise = measure_tracker_noise(held_still(draw, 1.4, 0.5, 200.0, 30.0));
    ASSERT_TRUE(noise) << noise.error().message;
    EXPECT_TRUE(noise->drifts) << seed;
    EXPECT_LE(std::abs(noise->position_deviation_mm - 1.4), 3.0 * noise->position_deviation_mm_deviation) << seed;
    EXPECT_LE(std::abs(noise->rotation_deviation_deg - 0.5), 3.0 * noise->rotation_deviation_deg_deviation) << seed;
  }
}

TEST(TrackerNoise, RefusesASensorThatMovesAndOneThatRepeatsItself) {
  Draw draw(2);
  auto poses = held_still(draw, 0.3, 0.1, 0.0, 30.0);
  auto moving = poses;
  for (TimedPose& pose : moving) pose.X.t.x() += 100.0 * std::sin(3.0 * pose.t_s);
  EXPECT_THAT(measure_tracker_noise(moving).error().message, HasSubstr("still for"));
  for (TimedPose& pose : poses) pose.X = poses.front().X;
  EXPECT_THAT(measure_tracker_noise(poses).error().message, HasSubstr("same to the last bit"));
}

// ---- how briskly a scope was moved

TEST(BriskSpeed, IsOfWhatCameraAndTrackerShareAndNotOfTheNoiseOfEither) {
  const Pose X_SC{so3_exp({0.4, -0.3, 1.9}), {3.0, 5.0, 60.0}};
  const auto told = [&](double brisk_rad) {
    Draw draw(5);
    std::vector<PosePair> pairs;
    for (int i = 0; i < 600; ++i) {
      const double t = i / 15.0;
      const Pose X_BC{so3_exp(0.4 * Vector3d(std::sin(0.6 * t), std::sin(0.5 * t + 1.0), std::sin(0.4 * t))) *
                          so3_exp(brisk_rad * Vector3d(std::sin(12.0 * t), std::cos(10.0 * t), 0.0)),
                      Vector3d::Zero()};
      Pose X_WS = X_BC * X_SC.inverse();
      PosePair pair{t, X_WS, X_BC, Vector6d::Zero()};
      pair.X_BC.R = pair.X_BC.R * so3_exp(draw.vector(1.0 * kDegree));
      pair.X_WS.R = pair.X_WS.R * so3_exp(draw.vector(0.3 * kDegree));
      pairs.push_back(pair);
    }
    return brisk_speed(pairs, X_SC.R);
  };
  EXPECT_LT(told(0.0), 0.1);
  // What speeds over 0.13 s, less their mean over half a second, leave of 12 and 10 rad/s: 0.855 and 0.705.
  const double left = 0.06 * std::sqrt(0.5 * (std::pow(0.855 * 12.0, 2.0) + std::pow(0.705 * 10.0, 2.0)));
  EXPECT_NEAR(told(0.06), left, 0.15 * left);
}

// ---- which of the touches are the landmarks

TEST(TouchedLandmarks, AreFoundAmongWhatElseThePointerWasHeldStillAt) {
  Draw draw(8);
  const std::vector<Vector3d> landmarks{{90, 0, 25}, {45, 60, -25}, {-45, 60, 25}, {-90, 0, -25}, {-40, -70, 20}};
  const Pose X_WI{draw.rotation(), {100.0, 50.0, -900.0}};
  std::vector<Vector3d> places{{0.0, 0.0, 0.0}};  // on the table
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    places.push_back(X_WI * landmarks[i] + draw.vector(0.5));
    if (i == 2) places.push_back(X_WI * Vector3d(0.0, 30.0, 60.0));  // a rest in between
  }
  places.emplace_back(0.0, 10.0, 0.0);
  const auto chosen = touched_landmarks(landmarks, places);
  ASSERT_TRUE(chosen);
  EXPECT_EQ(*chosen, (std::vector<std::size_t>{1, 2, 3, 5, 6}));
  places.resize(4);
  EXPECT_FALSE(touched_landmarks(landmarks, places)) << "one is missing";
  const std::vector<Vector3d> three(landmarks.begin(), landmarks.begin() + 3);
  EXPECT_FALSE(touched_landmarks(three, places)) << "three of four places fit anyhow";
  places.resize(3);
  EXPECT_EQ(*touched_landmarks(three, places), (std::vector<std::size_t>{0, 1, 2}));
}

}  // namespace
}  // namespace perimap
