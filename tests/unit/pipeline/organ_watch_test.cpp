#include "core/pipeline/organ_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <vector>

namespace perimap {
namespace {

// Twenty-four converged features that keep still 100 mm before a camera that sways, at 15 frames a second, with a
// tracker of 1.4 mm and 0.5 degrees RMS whose sensor sits 200 mm behind.
struct Organ : ::testing::Test {
  static constexpr int kFeatures = 24;
  static constexpr double kFrames_per_s = 15.0;

  PipelineSettings settings;
  PixelModel model;
  FrameHistory history{BasisLayout{1, 0}};
  std::vector<FeatureSlot> slots{kFeatures};
  std::unique_ptr<MapBank> bank;
  std::vector<FeatureGroup> groups;
  std::vector<Vector3d> places;
  FrameJob job;
  ImagePhase image;
  std::unique_ptr<OrganWatch> watch;
  std::mt19937 generator{17};
  std::int64_t frames = 0;
  std::optional<Pose> tool;  // by how much the patient's tool has been moved; none: there is none
  std::int64_t readings = 0;
  bool converged = true;  // some feature is called so

  Organ() {
    settings.pose.position_deviation_mm = 1.4 / std::sqrt(3.0);
    settings.pose.rotation_deviation_rad = 0.5 / 57.3 / std::sqrt(3.0);
    settings.estimator.layout = {1, 0};
    settings.camera = model.camera = {640, 480, 500, 500, 320, 240, 0, 0, 0, 0, 0};
    bank = std::make_unique<MapBank>(BankSettings{.layout = settings.estimator.layout, .features = kFeatures},
                                     Precision::kDouble);
    std::uniform_real_distribution<double> place(-30.0, 30.0);
    for (int f = 0; f < kFeatures; ++f) {
      places.emplace_back(place(generator), place(generator), 100.0 + 0.3 * place(generator));
      FeatureEstimate estimate = prior_estimate(settings.estimator.layout, Prior{}, places.back());
      estimate.P *= 1e-5;
      bank->set(f, estimate);
      FeatureSlot& slot = slots[static_cast<std::size_t>(f)];
      slot.state = SlotState::kMapped;
      slot.converged = true;
      slot.in_view = true;
    }
    for (int g = 0; g < bank->groups(); ++g) {
      groups.emplace_back(*bank, g, std::span(slots).subspan(static_cast<std::size_t>(g) * kLanes, kLanes));
    }
    watch = std::make_unique<OrganWatch>(settings);
  }

  [[nodiscard]] Vector3d normal3() {
    std::normal_distribution<double> normal;
    const double x = normal(generator);
    const double y = normal(generator);
    return {x, y, normal(generator)};
  }

  // The patient's tool, 60 mm beside the organ, as the tracker reads it where it has been moved by `tool`: 50 readings
  // a second until t.
  void read_tool(double t) {
    if (!tool) return;
    const double per_axis = 1.0 / std::sqrt(3.0);
    for (; static_cast<double>(readings) / 50.0 <= t; ++readings) {
      TrackerSample sample;
      sample.source_time = sample.arrival = Instant(std::chrono::milliseconds(20 * readings));
      sample.state = ToolState::kOk;
      sample.X_WS = *tool * Pose{so3_exp(Vector3d(0.3, 0.0, 0.0)), Vector3d(60.0, 10.0, 110.0)};
      sample.X_WS.t += 1.4 * per_axis * normal3();
      sample.X_WS.R = so3_exp(0.5 / 57.3 * per_axis * normal3()) * sample.X_WS.R;
      watch->add_tool(sample);
    }
  }

  // A frame that shows the organ where X maps its points to.
  void frame(const Pose& X) {
    const double t = static_cast<double>(++frames) / kFrames_per_s;
    read_tool(t);
    watch->note_converged(converged);
    const Pose X_WC{so3_exp(0.05 * Vector3d(std::sin(t), std::cos(0.6 * t), 0.0)),
                    Vector3d(15.0 * std::sin(0.9 * t), 10.0 * std::sin(0.5 * t), 5.0 * std::sin(0.3 * t))};
    FrameStamp stamp;
    stamp.capture = stamp.arrival = Instant(std::chrono::milliseconds(static_cast<std::int64_t>(1000.0 * t)));
    FrameRecord& record = history.append(stamp);
    CameraPose told;
    told.state = CameraPose::State::kInterpolated;
    told.lever_W_mm = X_WC.R * Vector3d(0.0, 0.0, 200.0);
    const double turn_rad = 0.5 / 57.3 / std::sqrt(3.0);
    const double shift_mm = 1.4 / std::sqrt(3.0);
    told.rotation_variance_rad2 = turn_rad * turn_rad;
    told.position_variance_mm2 = shift_mm * shift_mm;
    const Vector3d turned = turn_rad * normal3();
    told.X_WC.R = so3_exp(turned) * X_WC.R;
    told.X_WC.t = X_WC.t + turned.cross(told.lever_W_mm) + shift_mm * normal3();
    FrameHistory::set_pose(record, watch->pose_by_map(told));
    record.measurable = true;
    record.phase = {1.0, 7.0, 0.005, PhaseState::kLocked, false};
    record.b = basis_at(settings.estimator.layout, 1.0);
    record.b_rate = basis_rate(settings.estimator.layout, 1.0);
    job.frame = &record;
    job.about_capture = bases_about(settings.estimator.layout, record.phase, record.respiration);
    job.history = &history;
    job.evaluated_b.fill(record.b);
    job.plan.end = kReleasesCovered;
    for (FeatureGroup& group : groups) group.sweep(job);
    for (std::size_t f = 0; f < slots.size(); ++f) {
      Vector2d px;
      ASSERT_EQ(model.camera.project(X_WC.inverse() * (X * places[f]), px), ProjectionStatus::kOk);
      slots[f].match.state = MatchState::kFound;
      slots[f].match.px = px + 0.2 * normal3().head<2>();
      slots[f].match.covariance_px2 = 0.04 * Matrix2d::Identity();
      slots[f].match_agrees = true;
    }
    watch->watch(image, groups, record);
  }

  // As the mapper does.
  void move_map(const Pose& X) {
    for (std::size_t f = 0; f < places.size(); ++f) {
      FeatureEstimate estimate;
      bank->get(static_cast<int>(f), estimate);
      const int n = settings.estimator.layout.size();
      const Vector3d p = X * Vector3d(estimate.x(0), estimate.x(n), estimate.x(2 * n));
      for (int axis = 0; axis < 3; ++axis) estimate.x(axis * n) = p(axis);
      bank->set(static_cast<int>(f), estimate);
    }
    watch->begin_anew();
  }

  void seconds(double s, const Pose& X) {
    for (int i = 0; i < static_cast<int>(s * kFrames_per_s); ++i) frame(X);
  }
};

const Pose kMoved{so3_exp(Vector3d(0.0, 0.0, 0.03)), Vector3d(4.0, -3.0, 1.0)};

TEST_F(Organ, ThatKeepsStillIsNotDoubted) {
  for (int i = 0; i < 60; ++i) {
    seconds(1.0, Pose{});
    ASSERT_FALSE(watch->displaced()) << i;
  }
}

TEST_F(Organ, ThatIsMovedIsDoubtedWithinTwoSecondsAndForAsLongAsItStaysThere) {
  seconds(15.0, Pose{});
  const Instant moved = job.frame->stamp.capture;
  seconds(2.0, kMoved);
  ASSERT_TRUE(watch->displaced());
  EXPECT_LE(*watch->displaced_since(), moved);
  for (int i = 0; i < 60; ++i) {
    seconds(1.0, kMoved);
    ASSERT_TRUE(watch->displaced()) << i;
  }
}

TEST_F(Organ, IsNotAskedOfBeforeAFeatureHasConverged) {
  converged = false;
  seconds(5.0, Pose{});
  seconds(10.0, kMoved);
  EXPECT_FALSE(watch->displaced()) << "it has no place yet";
  converged = true;
  frame(kMoved);
  EXPECT_FALSE(watch->displaced()) << "what was seen before counts for nothing";
  seconds(3.0, kMoved);
  EXPECT_TRUE(watch->displaced());
}

TEST_F(Organ, ThatIsMovedIsFollowed) {
  seconds(15.0, Pose{});
  seconds(10.0, kMoved);
  double off_mm = 0.0;
  for (const Vector3d& p : places) off_mm = std::max(off_mm, (watch->displacement() * p - kMoved * p).norm());
  EXPECT_LT(off_mm, 4.0);
  EXPECT_NEAR(watch->size_mm(), 5.2, 2.0);
}

TEST_F(Organ, ThatIsPutBackIsBelievedAgain) {
  seconds(15.0, Pose{});
  seconds(10.0, kMoved);
  ASSERT_TRUE(watch->displaced());
  seconds(6.0, Pose{});
  EXPECT_FALSE(watch->displaced());
}

TEST_F(Organ, ThatIsMovedIsNotBelievedByMovingThePosesWithIt) {
  seconds(15.0, Pose{});
  seconds(3.0, kMoved);
  ASSERT_TRUE(watch->displaced());
  // The frame's pose is that of a camera before the map.
  const Pose X_WM = job.frame->pose.X_WC * (kMoved.inverse() * job.frame->pose.X_WC).inverse();
  EXPECT_GT((X_WM * places[0] - places[0]).norm(), 2.0);
}

TEST_F(Organ, IsAtItsPlaceOnceTheMapHasBeenMovedWithItAndIsNotBelievedBefore) {
  seconds(15.0, Pose{});
  seconds(8.0, kMoved);
  ASSERT_TRUE(watch->resting().has_value());
  const RestingOrgan organ = *watch->resting();
  EXPECT_LE(organ.deviation_mm, 1.0);
  double off_mm = 0.0;
  for (const Vector3d& p : places) off_mm = std::max(off_mm, (organ.X * p - kMoved * p).norm());
  EXPECT_LT(off_mm, 3.0 * organ.deviation_mm);
  move_map(organ.X);
  EXPECT_FALSE(watch->displaced());
  EXPECT_TRUE(watch->unproven());
  for (int i = 0; i < 30; ++i) {
    seconds(1.0, kMoved);
    ASSERT_FALSE(watch->displaced()) << i;
  }
  EXPECT_FALSE(watch->unproven());
}

// The two twins: the images show the same.
TEST_F(Organ, ThatItsToolHasMovedWithWasMoved) {
  tool = Pose{};
  seconds(15.0, Pose{});
  tool = kMoved;
  seconds(3.0, kMoved);
  ASSERT_TRUE(watch->displaced());
  EXPECT_EQ(watch->cause(), DisplacedCause::kOrgan);
  seconds(3.0, kMoved);
  ASSERT_TRUE(watch->carried().has_value());
  const RestingOrgan organ = *watch->carried();
  EXPECT_LE(organ.deviation_mm, 0.7);
  double off_mm = 0.0;
  for (const Vector3d& p : places) off_mm = std::max(off_mm, (organ.X * p - kMoved * p).norm());
  EXPECT_LT(off_mm, 3.0 * organ.deviation_mm);
}

TEST_F(Organ, WhoseToolHasNotMovedIsSeenByATrackerThatErrs) {
  tool = Pose{};
  seconds(15.0, Pose{});
  for (int i = 0; i < 20; ++i) {
    seconds(1.0, kMoved);
    ASSERT_FALSE(watch->carried().has_value());
    if (i <= 2) continue;
    ASSERT_EQ(watch->cause(), DisplacedCause::kTracker) << i;
  }
  seconds(4.0, Pose{});
  EXPECT_FALSE(watch->displaced());
}

TEST_F(Organ, WhoseToolMovesOtherwiseMayBeEither) {
  tool = Pose{};
  seconds(15.0, Pose{});
  tool = kMoved.inverse();
  for (int i = 0; i < 10; ++i) {
    seconds(1.0, kMoved);
    ASSERT_FALSE(watch->carried().has_value());
    ASSERT_EQ(watch->cause(), DisplacedCause::kUnknown) << i;
  }
  EXPECT_TRUE(watch->displaced());
}

TEST_F(Organ, WhoseToolIsHiddenOrRepeatsItselfMayBeEither) {
  tool = Pose{};
  seconds(15.0, Pose{});
  tool.reset();
  seconds(4.0, kMoved);
  ASSERT_TRUE(watch->displaced());
  EXPECT_EQ(watch->cause(), DisplacedCause::kUnknown);
  TrackerSample stuck;
  stuck.state = ToolState::kOk;
  for (int i = 0; i < 60; ++i) {
    stuck.source_time = stuck.arrival = job.frame->stamp.capture + std::chrono::milliseconds(60);
    watch->add_tool(stuck);
    frame(kMoved);
  }
  EXPECT_EQ(watch->cause(), DisplacedCause::kUnknown);
}

TEST_F(Organ, ThatMovesWithItsToolIsNotFollowedBeforeItRests) {
  tool = Pose{};
  seconds(15.0, Pose{});
  for (int i = 0; i < 90; ++i) {
    tool = Pose{Matrix3d::Identity(), Vector3d(0.15 * i, 0.0, 0.0)};
    frame(*tool);
    ASSERT_FALSE(watch->carried().has_value()) << i;
  }
  EXPECT_EQ(watch->cause(), DisplacedCause::kOrgan);
}

TEST_F(Organ, ThatWasMovedOutOfSightWithItsToolIsToldByTheToolsPlaceBefore) {
  tool = Pose{};
  seconds(15.0, Pose{});
  tool = kMoved;
  read_tool(static_cast<double>(frames) / kFrames_per_s + 30.0);
  frames += static_cast<std::int64_t>(30.0 * kFrames_per_s);
  seconds(4.0, kMoved);
  ASSERT_TRUE(watch->displaced());
  EXPECT_EQ(watch->cause(), DisplacedCause::kOrgan);
}

TEST_F(Organ, ThatWasMovedTwiceWithItsToolIsToldEachTime) {
  tool = Pose{};
  seconds(15.0, Pose{});
  Pose X;
  for (int move = 0; move < 2; ++move) {
    X = kMoved * X;
    tool = X;
    seconds(5.0, X);
    ASSERT_TRUE(watch->carried().has_value()) << move;
    EXPECT_EQ(watch->cause(), DisplacedCause::kOrgan);
    move_map(watch->carried()->X);
    seconds(3.0, X);
    ASSERT_FALSE(watch->displaced()) << move;
    ASSERT_FALSE(watch->unproven()) << move;
  }
}

TEST_F(Organ, ThatStillMovesRestsNowhere) {
  seconds(15.0, Pose{});
  for (int i = 0; i < 150; ++i) {
    frame(Pose{Matrix3d::Identity(), Vector3d(0.15 * i, 0.0, 0.0)});
    ASSERT_FALSE(watch->resting().has_value()) << i;
  }
  EXPECT_TRUE(watch->displaced());
}

TEST_F(Organ, OutOfSightForSecondsIsProvenAnew) {
  seconds(15.0, Pose{});
  frames += static_cast<std::int64_t>(5.0 * kFrames_per_s);
  frame(Pose{});
  EXPECT_TRUE(watch->unproven());
  seconds(1.5, Pose{});
  EXPECT_FALSE(watch->unproven());
  EXPECT_FALSE(watch->displaced());
}

TEST_F(Organ, ThatTurnedAboutAPlaceFarFromWhatIsSeenIsMeasuredWhereItIsSeen) {
  seconds(5.0, Pose{});
  const Vector3d far(0.0, -80.0, 100.0);
  const Matrix3d R = so3_exp(Vector3d(0.06, 0.0, 0.0));
  seconds(6.0, Pose{R, far - R * far});
  ASSERT_TRUE(watch->displaced());
  EXPECT_NEAR(watch->size_mm(), 0.06 * 80.0, 1.5);
}

}  // namespace
}  // namespace perimap
