#include "core/pipeline/frame_history.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <numbers>

#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr double kTracker_mm2 = 0.04;

// Ten frames from 3 s on, a beat every 800 ms, and breathing that is searched for.
struct FramesBeforeBreathing : ::testing::Test {
  BasisLayout layout{2, 2};
  std::unique_ptr<FrameHistory> history = std::make_unique<FrameHistory>(layout);
  CardiacClockTracker clock{{}};
  RespiratoryClock searching;

  FramesBeforeBreathing() {
    searching.state = RespirationState::kSearching;
    searching.unknown_displacement_mm = 5.0;
    for (int ms = 1000; ms <= 5000; ms += 800) {
      const Instant t{milliseconds(ms)};
      clock.on_r_peak({t, t + milliseconds(60), 1.0, milliseconds(1)});
    }
    for (int i = 0; i < 10; ++i) {
      const Instant capture{milliseconds(3000 + 33 * i)};
      FrameRecord& frame = history->append({static_cast<std::uint64_t>(i), capture, capture + milliseconds(12)});
      CameraPose pose;
      pose.state = CameraPose::State::kInterpolated;
      pose.position_variance_mm2 = kTracker_mm2;
      FrameHistory::set_pose(frame, pose);
      history->set_phase(frame, clock.clock(), searching);
    }
    history->refresh_phases(clock.clock(), searching);
  }
};

TEST_F(FramesBeforeBreathing, HaveItsPhaseAndNoDisplacementMoreOnceItIsFound) {
  ASSERT_NEAR(history->find(0)->pose.position_variance_mm2, kTracker_mm2 + 25.0, 1e-12);
  ASSERT_FALSE(history->find(0)->respiration.known);
  EXPECT_EQ(history->span(), milliseconds(9 * 33));
  RespiratoryClock found = searching;
  found.state = RespirationState::kLocked;
  found.time = Instant(milliseconds(4000));
  found.phase_rad = 0.5;
  found.rate_rad_per_s = 2.0 * std::numbers::pi / 4.0;
  found.phase_variance_rad2 = 0.01;
  found.slope_mm_per_rad = 3.0;
  history->retell_respiration(found);
  for (std::uint64_t i = 0; i < history->count(); ++i) {
    const FrameRecord& frame = *history->find(i);
    EXPECT_TRUE(frame.phase.exact);
    EXPECT_TRUE(frame.respiration.known);
    EXPECT_NEAR(frame.pose.position_variance_mm2, kTracker_mm2 + 0.09, 1e-12);
    const double breath_rad = 0.5 + found.rate_rad_per_s * (0.033 * static_cast<double>(i) - 1.0);
    EXPECT_LT((frame.b - basis_at(layout, frame.phase.phase_rad, breath_rad)).norm(), 1e-9);
  }
}

// A beat becomes known before a frame that was captured ahead of it, as from a trigger, and what is learnt by has its R
// peak ahead of an earlier frame too.
TEST(FramesAroundAnRPeak, AreAllToldExactlyByTheNextBeatWhereverItIsMoved) {
  for (int moved_ms = -12; moved_ms <= 12; ++moved_ms) {
    CardiacClockTracker clock{{}};
    FrameHistory history(BasisLayout{2, 0});
    Instant next_beat(milliseconds(1000));
    const auto told = [&] {
      return clock.clock().with_r_peaks(
          std::array{MovedRPeak{clock.clock().beats(), milliseconds(moved_ms), milliseconds(1)}});
    };
    for (int i = 0; i < 600; ++i) {
      const Instant capture(milliseconds(1000) + i * std::chrono::microseconds(8333));
      if (next_beat + milliseconds(10) <= capture + milliseconds(25)) {
        clock.on_r_peak({next_beat, next_beat + milliseconds(10), 1.0, milliseconds(1)});
        next_beat += milliseconds(800);
        history.refresh_phases(told(), {});
      }
      history.set_phase(history.append({static_cast<std::uint64_t>(i), capture, capture + milliseconds(25)}),
                        clock.clock(), {});
    }
    history.refresh_phases(told(), {});
    const Instant locked = Instant(milliseconds(2600));
    for (std::uint64_t i = history.count() - FrameHistory::kHeld; i < history.count(); ++i) {
      const FrameRecord* frame = history.find(i);
      if (frame == nullptr || frame->stamp.capture < locked) continue;
      EXPECT_EQ(frame->phase.exact, frame->stamp.capture < told().anchor()) << i << ", moved by " << moved_ms << " ms";
    }
  }
}

struct FramesOfACamera : ::testing::Test {
  std::unique_ptr<FrameHistory> history = std::make_unique<FrameHistory>(BasisLayout{2, 0});

  // How many of them are there to be learnt from.
  int append(int frames, double rate_hz, double from_s = 1.0) {
    int held = 0;
    for (int i = 0; i < frames; ++i) {
      const Instant capture(from_seconds(from_s + i / rate_hz));
      held += history->append({static_cast<std::uint64_t>(i), capture, capture}).held ? 1 : 0;
    }
    return held;
  }
};

TEST_F(FramesOfACamera, AreAllHeldUpToSixtyASecond) {
  EXPECT_EQ(append(1000, 30.0), 1000);
  EXPECT_EQ(history->find(1000 - FrameHistory::kHeld - 1), nullptr);
  EXPECT_NE(history->find(1000 - FrameHistory::kHeld), nullptr);
  EXPECT_EQ(append(1000, 60.0, 100.0), 1000);
}

TEST_F(FramesOfACamera, OfAFastOneEnoughAreHeldForTheSlowestHeartsCycle) {
  for (const double rate_hz : {100.0, 120.0, 200.0, 240.0}) {
    history = std::make_unique<FrameHistory>(BasisLayout{2, 0});
    EXPECT_GE(append(2000, rate_hz), 2000 * 50 / static_cast<int>(rate_hz)) << rate_hz;
    const auto two_seconds = static_cast<std::uint64_t>(2.2 * rate_hz);
    EXPECT_NE(history->find(2000 - two_seconds), nullptr) << rate_hz;
    EXPECT_GT(to_seconds(history->span()), 3.0) << rate_hz;
  }
}

TEST_F(FramesOfACamera, AreHeldAfterItsClockHasJumpedBack) {
  append(100, 30.0, 50.0);
  EXPECT_EQ(append(100, 30.0, 1.0), 100);
}

}  // namespace
}  // namespace perimap
