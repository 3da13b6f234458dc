#include "core/pipeline/match_window.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <memory>
#include <vector>

#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr int kFramePeriod_ms = 33;
const Vector3d kVelocity_mm_per_s(12.0, -4.0, 3.0);
const Vector3d kTurn_rad_per_s(0.1, 0.2, -0.05);

// A camera that moves evenly, before a heart that beats every 800 ms; a mapped feature, one that is followed only, and
// one that is not found.
struct WatchedFrames : ::testing::Test {
  std::unique_ptr<FrameHistory> history = std::make_unique<FrameHistory>(BasisLayout{2, 0});
  std::unique_ptr<MatchWindow> window = std::make_unique<MatchWindow>(3);
  std::vector<FeatureSlot> slots = std::vector<FeatureSlot>(3);
  CardiacClockTracker clock{{}};
  int next_beat_ms = 1000;
  PixelMap picture;
  int frames = 0;

  WatchedFrames() {
    for (std::size_t i = 0; i < 3; ++i) {
      slots[i].state = i == 0 ? SlotState::kMapped : SlotState::kTracked;
      slots[i].id = static_cast<std::uint32_t>(10 + i);
      slots[i].match.state = i < 2 ? MatchState::kFound : MatchState::kTooFar;
      slots[i].match.px = Vector2d(static_cast<double>(i), 1.0);
    }
  }

  void add_frame() {
    const Instant capture{milliseconds(3000 + kFramePeriod_ms * frames)};
    while (Instant(milliseconds(next_beat_ms + 60)) <= capture) {
      const Instant t{milliseconds(next_beat_ms)};
      clock.on_r_peak({t, t + milliseconds(60), 1.0, milliseconds(1)});
      history->refresh_phases(clock.clock(), {});
      next_beat_ms += 800;
    }
    FrameRecord& frame = history->append({static_cast<std::uint64_t>(frames++), capture, capture + milliseconds(12)});
    CameraPose pose;
    pose.state = CameraPose::State::kInterpolated;
    const double t_s = to_seconds(capture.time_since_epoch());
    pose.X_WC = {so3_exp(Vector3d(t_s * kTurn_rad_per_s)), t_s * kVelocity_mm_per_s};
    FrameHistory::set_pose(frame, pose);
    frame.picture = picture;
    history->set_phase(frame, clock.clock(), {});
    window->tell(*history);
    window->add(frame, slots);
  }
  void add_seconds(double seconds) {
    for (const int until = frames + static_cast<int>(seconds * 1000 / kFramePeriod_ms); frames < until;) add_frame();
  }
};

TEST_F(WatchedFrames, AreAboutTwentyASecondForTwentySeconds) {
  add_seconds(40.0);
  EXPECT_NEAR(static_cast<double>(window->end() - window->begin()), 20.0 / 0.05, 4.0);
  const Instant oldest = window->frame(window->begin()).capture, newest = window->frame(window->end() - 1).capture;
  EXPECT_LE(newest - oldest, MatchWindow::kLength);
  for (std::uint64_t i = window->begin(); i + 1 < window->end(); ++i) {
    EXPECT_LE(window->frame(i + 1).capture - window->frame(i).capture, milliseconds(66));
  }
}

TEST_F(WatchedFrames, HoldTheMatchesThatWereFound) {
  add_frame();
  const auto matches = window->matches(window->begin());
  ASSERT_EQ(matches.size(), 2U);
  EXPECT_EQ(matches[1].slot, 1U);
  EXPECT_EQ(matches[1].id, 11U);
  EXPECT_EQ(matches[1].px, Vector2d(1.0, 1.0));
}

TEST_F(WatchedFrames, HoldMatchesAsTheLensModelHasThem) {
  picture = {Vector2d(2.0, 4.0), Vector2d(-7.0, 1.0)};
  slots[1].match.covariance_px2 = Matrix2d::Identity();
  add_frame();
  const WindowMatch& match = window->matches(window->begin())[1];
  EXPECT_EQ(match.px, Vector2d(4.0, 0.0));
  EXPECT_NEAR(match.covariance_px2(0, 0), 0.25, 1e-12);
  EXPECT_NEAR(match.covariance_px2(1, 1), 0.0625, 1e-12);
}

TEST_F(WatchedFrames, AreUselessFromWherePosesWereMistaken) {
  add_seconds(5.0);
  const std::size_t told = window->told();
  const std::uint64_t since = window->frame(window->begin() + 5).index;
  window->disown(since);
  EXPECT_EQ(window->told(), 5U);
  EXPECT_LT(window->told(), told);
  EXPECT_LT(window->newest_told(), since);
}

TEST_F(WatchedFrames, GoWhenTheyAreOldThoughNoOtherCanBeMeasured) {
  add_seconds(5.0);
  const std::uint64_t newest = window->newest_told();
  EXPECT_GT(newest, 0U);
  for (int i = 0; i < 25 * 30; ++i) {
    const Instant capture{milliseconds(3000 + kFramePeriod_ms * frames)};
    history->append({static_cast<std::uint64_t>(frames++), capture, capture + milliseconds(12)});
    window->tell(*history);
  }
  EXPECT_EQ(window->begin(), window->end());
  EXPECT_EQ(window->newest_told(), 0U);
}

TEST_F(WatchedFrames, AreToldOnceTheirCycleHasEnded) {
  add_seconds(0.3);
  EXPECT_EQ(window->told(), 0U);
  add_seconds(3.0);
  const std::size_t told = window->told();
  EXPECT_GT(told, 20U);
  EXPECT_LT(told, window->end() - window->begin());
  for (std::uint64_t i = window->begin(); i < window->begin() + told; ++i) {
    const WindowFrame& frame = window->frame(i);
    ASSERT_EQ(frame.state, WindowFrame::State::kTold);
    EXPECT_TRUE(frame.phase.exact);
    EXPECT_EQ(frame.phase.phase_rad, history->find(frame.index)->phase.phase_rad);
  }
}

TEST_F(WatchedFrames, HaveOtherPhasesByAnotherLawHoweverOldTheyAre) {
  add_seconds(18.0);
  const WindowFrame before = window->frame(window->begin() + 5);
  ASSERT_EQ(history->find(before.index), nullptr) << "it has left the history";
  CardiacClockSettings other;
  other.law.law = PhaseLaw::kTimeLocked;
  CardiacClockTracker locked(other);
  for (int ms = 1000; ms < next_beat_ms; ms += 800) {
    const Instant t{milliseconds(ms)};
    locked.on_r_peak({t, t + milliseconds(60), 1.0, milliseconds(1)});
  }
  window->retell_phases(locked.clock());
  const WindowFrame& after = window->frame(window->begin() + 5);
  EXPECT_EQ(after.state, WindowFrame::State::kTold);
  EXPECT_EQ(after.phase.phase_rad, locked.clock().at(before.capture).phase_rad);
  EXPECT_NE(after.phase.phase_rad, before.phase.phase_rad);
}

TEST_F(WatchedFrames, HaveBreathingOnceItIsFound) {
  add_seconds(5.0);
  RespiratoryClock found;
  found.state = RespirationState::kLocked;
  found.time = Instant(milliseconds(7000));
  found.phase_rad = 0.5;
  found.rate_rad_per_s = 1.5;
  window->retell_respiration(found);
  const WindowFrame& frame = window->frame(window->begin());
  EXPECT_TRUE(frame.respiration.known);
  EXPECT_EQ(frame.respiration.phase_rad, found.at(frame.capture).phase_rad);
}

TEST_F(WatchedFrames, TellHowFastTheCameraMovesInItsOwnAxes) {
  add_seconds(3.0);
  const WindowFrame& frame = window->frame(window->begin() + 10);
  ASSERT_EQ(frame.state, WindowFrame::State::kTold);
  EXPECT_LT((frame.X_WC.R * frame.twist.move_C_mm_per_s - kVelocity_mm_per_s).norm(), 1e-6);
  EXPECT_LT((frame.twist.turn_C_rad_per_s - kTurn_rad_per_s).norm(), 1e-3);
}

TEST_F(WatchedFrames, AreNoneWithoutAPhaseOrAPoseToMeasureBy) {
  FrameRecord& frame = history->append({0, Instant{milliseconds(10)}, Instant{milliseconds(20)}});
  window->add(frame, slots);
  EXPECT_EQ(window->begin(), window->end());
}

TEST_F(WatchedFrames, BeginAnewWhenTheyAreCleared) {
  add_seconds(5.0);
  window->clear();
  EXPECT_EQ(window->told(), 0U);
  add_seconds(2.0);
  EXPECT_GT(window->told(), 5U);
}

}  // namespace
}  // namespace perimap
