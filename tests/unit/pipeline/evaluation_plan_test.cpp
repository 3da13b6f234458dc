#include "core/pipeline/evaluation_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>

namespace perimap {
namespace {

using std::chrono::milliseconds;

// A camera whose frames arrive 12 ms after their capture.
struct Camera : ::testing::Test {
  static constexpr Duration kDelay = milliseconds(12);

  PipelineSettings settings;
  std::unique_ptr<FrameHistory> history = std::make_unique<FrameHistory>(BasisLayout{2, 0});
  Duration period = milliseconds(33);
  Instant next{std::chrono::seconds(5)};
  const FrameRecord* newest = nullptr;
  EvaluationPlan plan;

  Camera() {
    settings.latency = milliseconds(50);
    settings.lead = milliseconds(5);
  }

  // Its number on the wire begins at 100.
  FrameRecord& append() {
    FrameRecord& frame = history->append({100 + history->count(), next, next + kDelay});
    newest = &frame;
    next += period;
    return frame;
  }
  void run(int frames) {
    for (int i = 0; i < frames; ++i) append();
    plan = plan_evaluation(*history, *newest, known(), settings);
  }
  [[nodiscard]] Instant known() const { return newest->stamp.arrival; }
  [[nodiscard]] Instant valid_of(std::uint64_t index) const {
    return history->find(index)->stamp.capture + settings.latency + settings.lead;
  }
};

TEST_F(Camera, TheNextReleasesAreOfTheOldestFrameToComeAndTheNext) {
  run(40);
  // With 50 ms from capture to release, 33 ms between frames and 12 ms of delay the frame before is still to come.
  EXPECT_EQ(plan.instants[0], valid_of(38));
  EXPECT_EQ(plan.instants[1], valid_of(39));
  EXPECT_EQ(plan.instants[2], valid_of(39) + period) << "of a frame that is to come";
  EXPECT_EQ(plan.begin, 0U);
  EXPECT_EQ(plan.end, kReleasesCovered);
  for (std::size_t i = plan.end; i < kCovariances; ++i) EXPECT_EQ(plan.instants[i], Instant{}) << "not asked for";
}

TEST_F(Camera, AReleaseThatIsDueJustWhenTheUpdateIsKnownCounts) {
  run(40);
  const Instant due = history->find(38)->stamp.capture + settings.latency;
  EXPECT_EQ(oldest_unreleased(*history, *newest, due, settings.latency), 38U);
  EXPECT_EQ(oldest_unreleased(*history, *newest, due + Duration(1), settings.latency), 39U);
}

TEST_F(Camera, WhereLIsManyFramesTheReleasesAreOfFramesLongBefore) {
  settings.latency = milliseconds(500);
  run(40);
  // 500 ms before the arrival: 15 frames, less 12 ms.
  const std::uint64_t oldest = oldest_unreleased(*history, *newest, known(), settings.latency);
  EXPECT_EQ(oldest, 39U - 14U);
  EXPECT_EQ(plan.instants[0], valid_of(oldest));
  EXPECT_EQ(plan.instants[2], valid_of(oldest + 2));
}

TEST_F(Camera, WhereLIsLessThanAPeriodTheyAreOfThisFrameAndThoseToCome) {
  settings.latency = milliseconds(20);
  run(40);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(plan.instants[static_cast<std::size_t>(i)], valid_of(39) + i * period) << i;
}

TEST_F(Camera, OfAFastOneTheReleasesReachTenMillisecondsBeyondTheNextUpdate) {
  for (const double rate_hz : {60.0, 100.0, 120.0, 240.0, 500.0}) {
    history = std::make_unique<FrameHistory>(BasisLayout{2, 0});
    period = from_seconds(1.0 / rate_hz);
    run(200);
    const Duration covered = plan.instants[2] - plan.instants[0];
    EXPECT_GE(covered, std::min(period, kLongestCoveredPeriod) + milliseconds(10) - Duration(10)) << rate_hz;
    EXPECT_LE(covered, 2 * std::max(2 * period, Duration(milliseconds(10)))) << rate_hz;
  }
}

TEST_F(Camera, TheClocksInstantsBeginWhenTheUpdateIsKnownAndReachBeyondTheNextOne) {
  settings.frame_stream = false;
  settings.clock_period = milliseconds(10);
  run(40);
  EXPECT_EQ(plan.begin, kReleasesCovered);
  EXPECT_EQ(plan.end, kCovariances);
  EXPECT_EQ(plan.instants[kReleasesCovered], known() + settings.lead);
  EXPECT_GE(plan.instants[kCovariances - 1], known() + settings.lead + period + milliseconds(20) - Duration(10));
  EXPECT_TRUE(std::is_sorted(plan.instants.begin() + kReleasesCovered, plan.instants.end()));
  for (std::size_t i = 0; i < plan.begin; ++i) EXPECT_EQ(plan.instants[i], Instant{});
}

TEST_F(Camera, APoseThatComesLateIsWaitedForByBothStreams) {
  settings.clock_period = milliseconds(10);
  run(40);
  const Instant late = known() + milliseconds(35);
  const EvaluationPlan later = plan_evaluation(*history, *newest, late, settings);
  EXPECT_EQ(later.instants[0], valid_of(39)) << "the release of the frame before has passed by then";
  EXPECT_EQ(later.instants[kReleasesCovered], late + settings.lead);
  EXPECT_EQ(later.begin, 0U);
  EXPECT_EQ(later.end, kCovariances);
}

TEST_F(Camera, ThePeriodIsThatOfTheLastTwoFramesAndNoLongerThanCanBeCovered) {
  append();
  EXPECT_EQ(period_before(*history, *newest), kLongestCoveredPeriod) << "of the first frame";
  append();
  EXPECT_EQ(period_before(*history, *newest), milliseconds(33));
  next += milliseconds(400);
  append();
  EXPECT_EQ(period_before(*history, *newest), kLongestCoveredPeriod) << "frames were missing";
  next -= std::chrono::seconds(3);
  append();
  EXPECT_EQ(period_before(*history, *newest), kLongestCoveredPeriod) << "its clock has jumped back";
  append();
  EXPECT_EQ(period_before(*history, *newest), milliseconds(33));
}

TEST_F(Camera, TheFirstFrameHasAPlanToo) {
  settings.clock_period = milliseconds(10);
  run(1);
  EXPECT_EQ(plan.instants[0], valid_of(0));
  EXPECT_GT(plan.instants[1], plan.instants[0]);
  EXPECT_EQ(plan.cameras[0].frame_sequence, 100U);
  EXPECT_EQ(plan.cameras[1].frame_sequence, 0U);
}

TEST_F(Camera, CamerasAreToldOfTheFramesToComeAndOfSomeBefore) {
  for (int i = 0; i < 40; ++i) {
    CameraPose pose;
    if (i != 37) pose.state = CameraPose::State::kInterpolated;
    pose.X_WC.t.x() = i;
    FrameHistory::set_pose(append(), pose);
  }
  plan = plan_evaluation(*history, *newest, known(), settings);
  const std::uint64_t first = 38 - kCamerasBefore;
  for (std::size_t i = 0; i < kCamerasKept; ++i) {
    const FrameCamera& camera = plan.cameras[i];
    if (first + i > 39) {
      EXPECT_EQ(camera.frame_sequence, 0U);
      continue;
    }
    EXPECT_EQ(camera.frame_sequence, 100U + first + i);
    EXPECT_EQ(camera.place.known, first + i != 37);
    if (!camera.place.known) continue;
    EXPECT_EQ(camera.place.X_WC.t.x(), static_cast<double>(first + i));
    EXPECT_EQ(camera.place.lens.focal_px.x(), settings.camera.fx) << "and what its lens was";
  }
}

}  // namespace
}  // namespace perimap
