// daemon/setup: what is refused and in which words, results that are kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

#include "core/angle/angle.hpp"
#include "daemon/setup/camera_calibration.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/kept_result.hpp"
#include "daemon/setup/moved_noise.hpp"
#include "daemon/setup/setup_report.hpp"
#include "daemon/setup/signal_offset.hpp"

namespace perimap {
namespace {

using testing::HasSubstr;

struct Poses {
  std::vector<TimedPose> camera;
  std::vector<TimedPose> tracker;
};

// A camera swung about a board; `turns`: about how many axes.
Poses swung(int turns, double offset_s, const Pose& X_SC, double noise_mm = 0.2) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  Poses poses;
  for (int i = 0; i < 1200; ++i) {
    const double t = i / 30.0;
    Vector3d w(0.5 * std::sin(1.3 * t) + 0.2 * std::sin(4.1 * t), 0.5 * std::sin(1.9 * t + 1.0),
               0.6 * std::sin(0.9 * t + 2.0));
    if (turns < 3) w.z() = 0.0;
    if (turns < 2) w.y() = 0.0;
    if (turns < 1) w.x() = 0.0;
    const Pose X_BC{so3_exp(w),
                    Vector3d(30.0 * std::sin(t), 20.0 * std::cos(1.7 * t), 100.0 + 10.0 * std::sin(2.0 * t))};
    const Pose X_WB{so3_exp({0.3, 1.0, -0.4}), {100.0, 20.0, -900.0}};
    Pose X_WS = X_WB * X_BC * X_SC.inverse();
    X_WS.t += noise_mm * Vector3d(normal(generator), normal(generator), normal(generator));
    poses.camera.push_back({t + offset_s, X_BC});
    poses.tracker.push_back({t, X_WS});
  }
  return poses;
}

const Pose kX_SC{so3_exp({0.1, -0.2, 1.5}), {10.0, -5.0, 200.0}};

TEST(HandEye, IsFoundWithTheClocksOffset) {
  const Poses poses = swung(3, 0.4, kX_SC);
  const auto result = calibrate_hand_eye(poses.camera, poses.tracker, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_LT((result->X_SC.t - kX_SC.t).norm(), 0.5);
  EXPECT_LT(so3_log(result->X_SC.R.transpose() * kX_SC.R).norm(), 0.002);
  EXPECT_NEAR(result->offset_s, 0.4, 0.001);
  EXPECT_LT(result->residual_median_mm, 1.0);
}

// Squares that are smaller than was said: camera poses with longer lengths.
Poses with_longer_camera_lengths(Poses poses, double factor) {
  for (TimedPose& pose : poses.camera) pose.X.t *= factor;
  return poses;
}

TEST(HandEye, OfABoardThatIsMovedIsFoundBesideItsOwnSensor) {
  Poses poses = swung(3, 0.1, kX_SC);
  const Pose X_WT{so3_exp({0.4, -0.2, 0.1}), {120.0, 40.0, -880.0}};  // the board's sensor, at rest
  std::vector<TimedPose> board;
  for (TimedPose& pose : poses.tracker) {
    const double t = pose.t_s;
    const Pose moved{so3_exp(0.2 * Vector3d(std::sin(0.7 * t), std::cos(1.1 * t), std::sin(0.4 * t))),
                     Vector3d(30.0 * std::sin(0.5 * t), 20.0 * std::cos(0.8 * t), 10.0)};
    pose.X = moved * pose.X;
    board.push_back({t, moved * X_WT});
  }
  // The board's sensor is not seen for a while.
  board.erase(board.begin() + 300, board.begin() + 400);
  const auto relative = in_frame_of(board, poses.tracker);
  EXPECT_NEAR(static_cast<double>(relative.size()), 1100.0, 2.0);
  const auto result = calibrate_hand_eye(poses.camera, relative, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_LT((result->X_SC.t - kX_SC.t).norm(), 0.5);
  EXPECT_NEAR(result->offset_s, 0.1, 0.001);
  // As if it lay still: refused, or tens of millimetres wrong.
  const auto still = calibrate_hand_eye(poses.camera, poses.tracker, {});
  EXPECT_TRUE(!still || still->residual_median_mm > 10.0);
}

TEST(TrackerErrors, ThatGoWithThePlaceShowWhileTheSensorIsMoved) {
  Poses poses = swung(3, 0.1, kX_SC, 0.2);
  std::mt19937 generator(8);
  std::normal_distribution<double> normal(0.0, 0.1 * kDegree / std::sqrt(3.0));
  for (TimedPose& pose : poses.tracker) {
    pose.X.R = pose.X.R * so3_exp(Vector3d(normal(generator), normal(generator), normal(generator)));
  }
  const auto white = calibrate_hand_eye(poses.camera, poses.tracker, {});
  ASSERT_TRUE(white);
  TrackerErrors errors{MeasuredNoise{}, std::nullopt};
  errors.still.position_deviation_mm = 0.2 * std::sqrt(3.0);
  errors.still.rotation_deviation_deg = 0.1;
  errors.moved = *noise_while_moved(*white);
  EXPECT_FALSE(errors.larger_while_moved());
  EXPECT_EQ(errors.correlation_s(), 0.0);
  EXPECT_THAT(text_of(errors), HasSubstr("no more than at rest"));
  // A field that is bent over a few centimetres.
  for (TimedPose& pose : poses.tracker) {
    const Vector3d& p = pose.X.t;
    pose.X.t += 2.0 * Vector3d(std::sin(p.y() / 12.0), std::cos(p.z() / 15.0), std::sin(p.x() / 10.0));
  }
  const auto bent = calibrate_hand_eye(poses.camera, poses.tracker, {});
  ASSERT_TRUE(bent) << bent.error().message;
  errors.moved = *noise_while_moved(*bent);
  EXPECT_TRUE(errors.larger_while_moved());
  // Of 2.4 mm; a part looks like another hand-eye.
  EXPECT_GT(errors.position_deviation_mm(), 1.4);
  EXPECT_LT(errors.position_deviation_mm(), 2.6);
  EXPECT_GT(errors.correlation_s(), 0.05);
  EXPECT_LT(errors.correlation_s(), 2.0);
  EXPECT_GE(errors.rotation_deviation_deg(), 0.1);
  EXPECT_THAT(text_of(errors), HasSubstr("more than at rest"));
  EXPECT_EQ(json_of(errors)["position_deviation_mm"], errors.position_deviation_mm());
}

TEST(HandEye, OfABoardOfAnotherSizeIsRefused) {
  for (const double factor : {0.8, 1.06, 1.25}) {
    const Poses poses = with_longer_camera_lengths(swung(3, 0.1, kX_SC), factor);
    const auto result = calibrate_hand_eye(poses.camera, poses.tracker, {});
    ASSERT_FALSE(result) << factor;
    EXPECT_THAT(result.error().message, HasSubstr("times as large as was said"));
    EXPECT_THAT(result.error().message, HasSubstr("--square-mm"));
  }
}

TEST(HandEye, OfABoardThatIsALittleSmallerIsAsUncertainAsItIsWrong) {
  const Poses poses = with_longer_camera_lengths(swung(3, 0.1, kX_SC), 1.02);
  const auto result = calibrate_hand_eye(poses.camera, poses.tracker, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_NEAR(result->scale.ratio, 1.0 / 1.02, 0.002);
  const Vector3d error = result->X_SC.R.transpose() * (kX_SC.t - result->X_SC.t);
  EXPECT_GT(error.norm(), 0.1);
  const Matrix3d covariance = result->covariance.block<3, 3>(3, 3);
  EXPECT_LT(error.dot(covariance.ldlt().solve(error)), 16.0) << error.transpose() << "\n" << covariance;
}

TEST(HandEye, OfARightBoardHasItsScaleWithinItsDeviation) {
  const Poses poses = swung(3, 0.1, kX_SC);
  const auto result = calibrate_hand_eye(poses.camera, poses.tracker, {});
  ASSERT_TRUE(result);
  EXPECT_LT(std::abs(result->scale.ratio - 1.0), 4.0 * result->scale.deviation);
  EXPECT_LT(result->scale.deviation, 0.002);
}

TEST(HandEye, OfPosesAtRestIsFoundWithoutAnOffset) {
  const Poses all = swung(3, 0.0, kX_SC);
  Poses few;
  for (std::size_t i = 0; i < all.camera.size(); i += 40) {
    few.camera.push_back({static_cast<double>(i), all.camera[i].X});
    few.tracker.push_back({static_cast<double>(i), all.tracker[i].X});
  }
  few.camera[4].X.t += Vector3d(40.0, 0.0, 0.0);
  const auto result = calibrate_hand_eye(few.camera, few.tracker, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_FALSE(result->offset_measured);
  EXPECT_LT((result->X_SC.t - kX_SC.t).norm(), 1.0);
  EXPECT_EQ(result->used[4], 0);
}

TEST(HandEye, OfStopsWhoseTimesSayNothingIsFoundRowByRow) {
  const Poses all = swung(3, 0.0, kX_SC);
  Poses few;
  for (std::size_t i = 0; i < all.camera.size() && few.camera.size() < 25; i += 40) {
    few.camera.push_back({static_cast<double>(i), all.camera[i].X});
    few.tracker.push_back({5000.0 + static_cast<double>(i), all.tracker[i].X});
  }
  const auto result = calibrate_hand_eye(few.camera, few.tracker, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->paired_by_rows);
  EXPECT_LT((result->X_SC.t - kX_SC.t).norm(), 1.0);
  // As many rows, of which one is not there and another comes later: nothing agrees.
  std::rotate(few.tracker.begin(), few.tracker.begin() + 7, few.tracker.end());
  EXPECT_FALSE(calibrate_hand_eye(few.camera, few.tracker, {}));
}

TEST(HandEye, OffsetIsNotWhatSlowErrorsMakeOfIt) {
  Poses poses = swung(3, 0.4, kX_SC, 0.5);
  // Brisk turns beside the slow ones; and as of a lens that is off, or a board seen from one side, an error that goes
  // with the slow ones alone, as if the picture were 10 ms older.
  constexpr double kSeems_s = 0.01;
  for (std::size_t i = 0; i < poses.camera.size(); ++i) {
    const double t = poses.tracker[i].t_s;
    const Pose brisk{so3_exp(0.05 * Vector3d(std::sin(15.0 * t), std::cos(13.0 * t), 0.0)), Vector3d::Zero()};
    const Vector3d slow(0.65 * std::cos(1.3 * t), 0.95 * std::cos(1.9 * t + 1.0), 0.54 * std::cos(0.9 * t + 2.0));
    TimedPose& camera = poses.camera[i];
    TimedPose& tracker = poses.tracker[i];
    tracker.X = tracker.X * kX_SC * brisk * kX_SC.inverse();
    camera.X = camera.X * brisk;
    camera.X.R = camera.X.R * so3_exp(kSeems_s * slow);
  }
  const auto result = calibrate_hand_eye(poses.camera, poses.tracker, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_GT(std::abs(result->joint_offset_s - 0.4), 0.1 * kSeems_s);
  EXPECT_LT(std::abs(result->offset_s - 0.4), std::abs(result->joint_offset_s - 0.4));
  EXPECT_LT(std::abs(result->offset_s - 0.4), 3.0 * std::sqrt(result->covariance(6, 6)));
}

TEST(HandEye, MotionThatIsTooSlowToTellTimeIsTold) {
  Poses poses = swung(3, 0.4, kX_SC);
  for (TimedPose& pose : poses.camera) pose.t_s = 0.4 + 4.0 * (pose.t_s - 0.4);
  for (TimedPose& pose : poses.tracker) pose.t_s *= 4.0;
  const auto slow = calibrate_hand_eye(poses.camera, poses.tracker, {});
  ASSERT_TRUE(slow) << slow.error().message;
  EXPECT_FALSE(slow->is_brisk());
  EXPECT_THAT(text_of(*slow), HasSubstr("nothing moved briskly"));
  Poses brisk = swung(3, 0.4, kX_SC);
  for (std::size_t i = 0; i < brisk.camera.size(); ++i) {
    const double t = brisk.tracker[i].t_s;
    const Pose turn{so3_exp(0.05 * Vector3d(std::sin(15.0 * t), std::cos(13.0 * t), 0.0)), Vector3d::Zero()};
    brisk.tracker[i].X = brisk.tracker[i].X * kX_SC * turn * kX_SC.inverse();
    brisk.camera[i].X = brisk.camera[i].X * turn;
  }
  const auto fast = calibrate_hand_eye(brisk.camera, brisk.tracker, {});
  ASSERT_TRUE(fast) << fast.error().message;
  EXPECT_TRUE(fast->is_brisk());
}

std::string refusal_of(const Poses& poses) {
  const auto result = calibrate_hand_eye(poses.camera, poses.tracker, {});
  return result ? "accepted" : result.error().message;
}

TEST(HandEye, IsRefusedWhereTheMotionLeavesItOpen) {
  EXPECT_THAT(refusal_of(swung(1, 0.0, kX_SC)), HasSubstr("about one axis only"));
  EXPECT_NE(refusal_of(swung(0, 0.0, kX_SC, 0.0)), "accepted");
}

TEST(HandEye, IsRefusedWithoutCommonTimes) {
  EXPECT_THAT(refusal_of(swung(3, 500.0, kX_SC)), HasSubstr("never overlap"));
  Poses poses = swung(3, 0.0, kX_SC);
  poses.camera.resize(5);
  EXPECT_THAT(refusal_of(poses), HasSubstr("too few poses"));
}

TEST(HandEye, IsRefusedWhereTheTwoDoNotTurnAlike) {
  Poses poses = swung(3, 0.0, kX_SC);
  const Poses other = swung(3, 0.0, kX_SC);
  for (std::size_t i = 0; i < poses.tracker.size(); ++i) {
    // The same session, played three times as fast.
    poses.tracker[i].X = other.tracker[(3 * i + 200) % other.tracker.size()].X;
  }
  EXPECT_THAT(refusal_of(poses), HasSubstr("turn alike"));
}

std::vector<TimedValue> sampled(double interval_s, double shift_s, double period_s, double (*of)(double)) {
  std::vector<TimedValue> signal;
  for (double t = 0.0; t < 30.0; t += interval_s) signal.push_back({t, of((t - shift_s) / period_s)});
  return signal;
}

double uneven(double x) { return std::sin(x) + 0.7 * std::sin(2.3 * x + 1.0) + 0.5 * std::sin(0.37 * x); }

TEST(SignalOffset, IsFoundWhicheverIsFaster) {
  for (const auto& [first, second] : {std::pair(0.1, 0.02), std::pair(0.02, 0.1)}) {
    const auto result =
        measure_signal_offset(sampled(first, 0.061, 0.3, uneven), sampled(second, 0.0, 0.3, uneven), 1.0);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_NEAR(result->offset_s, 0.061, 0.003);
  }
}

TEST(SignalOffset, IsRefusedForAMotionThatRepeatsItself) {
  const auto sine = [](double x) { return std::sin(x); };
  const auto result = measure_signal_offset(sampled(0.02, 0.05, 0.05, sine), sampled(0.02, 0.0, 0.05, sine), 1.0);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("repeats itself"));
}

TEST(Camera, IsRefusedWithTooFewViewsAndWithViewsFromTheFront) {
  std::vector<BoardView> views;
  for (int v = 0; v < 8; ++v) {
    BoardView view;
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 9; ++x) {
        view.board_mm.emplace_back(10.0 * x, 10.0 * y, 0.0);
        view.px.emplace_back(400.0 + 40.0 * x + 5.0 * v + 0.3 * ((x * 7 + y * 3 + v) % 5 - 2),
                             200.0 + 40.0 * y + 4.0 * v);
      }
    }
    views.push_back(view);
  }
  EXPECT_THAT(calibrate_camera({views[0], views[1]}, 1280, 720, {}).error().message, HasSubstr("at least 7"));
  const auto flat = calibrate_camera(views, 1280, 720, {});
  ASSERT_FALSE(flat);
  EXPECT_THAT(flat.error().message, HasSubstr("tilt"));
}

// Of a board of 9x6 corners, all over the picture, or only in its middle and small.
std::vector<BoardView> drawn_views(std::size_t count, double distance, double aside) {
  std::mt19937 generator(11);
  std::normal_distribution<double> normal(0.0, 0.3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  CameraModel camera;
  camera.width = 1280, camera.height = 720;
  camera.fx = camera.fy = 1000.0, camera.cx = 640.0, camera.cy = 360.0, camera.k1 = -0.2;
  std::vector<BoardView> views;
  while (views.size() < count) {
    const Pose X_CB{so3_exp({0.7 * uniform(generator), 0.7 * uniform(generator), 1.6 * uniform(generator)}),
                    Vector3d(25.0 * aside * uniform(generator), 15.0 * aside * uniform(generator), distance)};
    BoardView view;
    bool whole = true;
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 9; ++x) {
        Vector2d px;
        const Vector3d p_B(8.0 * x, 8.0 * y, 0.0);
        whole = whole && camera.project(X_CB * (p_B - Vector3d(32.0, 20.0, 0.0)), px) == ProjectionStatus::kOk &&
                camera.contains(px);
        view.board_mm.push_back(p_B);
        view.px.push_back(px + Vector2d(normal(generator), normal(generator)));
      }
    }
    if (whole) views.push_back(view);
  }
  return views;
}

TEST(Camera, IsMeasuredBySevenViewsAndRefusedWithSix) {
  const auto seven = calibrate_camera(drawn_views(7, 110.0, 1.0), 1280, 720, {});
  ASSERT_TRUE(seven) << seven.error().message;
  EXPECT_NEAR(seven->camera.fx, 1000.0, 4.0 * seven->deviations[0]);
  const auto six = calibrate_camera(drawn_views(6, 110.0, 1.0), 1280, 720, {});
  ASSERT_FALSE(six);
  EXPECT_THAT(six.error().message, HasSubstr("at least 7 are needed"));
}

TEST(Camera, OfABoardThatIsSmallAndInTheMiddleIsRefusedUntilThereAreManyViews) {
  const auto few = calibrate_camera(drawn_views(8, 380.0, 0.2), 1280, 720, {});
  ASSERT_FALSE(few);
  EXPECT_THAT(few.error().message, HasSubstr("stays open"));
  EXPECT_THAT(few.error().message, HasSubstr("nothing of the board was seen"));
  const auto many = calibrate_camera(drawn_views(60, 380.0, 0.2), 1280, 720, {});
  EXPECT_TRUE(many);
}

TEST(Camera, OfWhichTooFewViewsFitTogetherIsRefused) {
  auto views = drawn_views(8, 110.0, 1.0);
  for (std::size_t v = 0; v < 2; ++v) {
    for (std::size_t i = 0; i < views[v].px.size(); ++i)
      views[v].px[i].x() += 12.0 * std::sin(7.0 * static_cast<double>(i));
  }
  const auto result = calibrate_camera(views, 1280, 720, {});
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("only 6 of the 8 views of the board that were tried fit together"));
}

TEST(ConfigurationKeys, AreSetInTheirPlace) {
  const std::string text =
      "version = 1\n# of the tracker\n[tracker]\nprotocol = \"ndi\"\n# hand-eye\n# time_offset_ms = 0.0\n\n[ecg]\nport "
      "= \"x\"\n";
  EXPECT_EQ(
      with_keys(text, "tracker", {{"time_offset_ms", "-30.2"}, {"position_deviation_mm", "0.3"}}, "measured"),
      "version = 1\n# of the tracker\n[tracker]\nprotocol = \"ndi\"\n# hand-eye\ntime_offset_ms = -30.2  # measured\n"
      "position_deviation_mm = 0.3  # measured\n\n[ecg]\nport = \"x\"\n");
  EXPECT_EQ(with_keys("version = 1\n", "tracker", {{"time_offset_ms", "1.0"}}, "m"),
            "version = 1\n[tracker]\ntime_offset_ms = 1.0  # m\n");
}

TEST(ConfigurationKeys, ThatDoNotHoldAnyMoreAreTakenOut) {
  EXPECT_EQ(with_keys("[tracker]\nhand_eye_sensor = \"0A\"\nport = \"x\"\n# hand_eye_date = \"\"\n", "tracker",
                      {{"hand_eye_sensor", ""}, {"hand_eye_date", ""}, {"time_offset_ms", ""}}, "m"),
            "[tracker]\nport = \"x\"\n# hand_eye_date = \"\"\n");
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

TEST(KeptResult, LeavesTheOneBeforeBesideIt) {
  const auto folder = std::filesystem::temp_directory_path() / "perimap_kept_result_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  const auto file = folder / "camera.yaml";
  ASSERT_TRUE(write_kept(file, "first\n"));
  ASSERT_TRUE(write_kept(file, "second\n"));
  EXPECT_EQ(text_of(file), "second\n");
  std::vector<std::string> others;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path() != file) others.push_back(text_of(entry.path()));
  }
  EXPECT_THAT(others, testing::ElementsAre("first\n"));
  const auto failed = write_kept(folder / "nowhere" / "camera.yaml", "third\n");
  EXPECT_FALSE(failed);
  std::filesystem::remove_all(folder);
}

TEST(KeptResult, AConfigurationThatWouldBeUnsoundIsLeftAsItIs) {
  const auto file = std::filesystem::temp_directory_path() / "perimap_set_keys_test.toml";
  std::ofstream(file) << "version = 1\n";
  const auto set = configuration_with_keys(file, "tracker", {{"time_offset_ms", "1e9"}}, "measured");
  EXPECT_FALSE(set);
  EXPECT_EQ(text_of(file), "version = 1\n");
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace perimap
