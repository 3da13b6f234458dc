#include "core/pipeline/scope_turn.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <thread>
#include <vector>

#include "angled_scope.hpp"
#include "core/angle/angle.hpp"
#include "core/pipeline/scope_watch.hpp"
#include "core/pipeline/unchanged_scope.hpp"
#include "counted_allocations.hpp"

namespace perimap {
namespace {

constexpr double kRead_rad = 0.1 * kDegree;  // deviation of a reading

TurnedScope angled() {
  TurnedScope scope = test::angled_scope();
  scope.width = 320;
  scope.height = 240;
  scope.focals = {{105.0, {300.0, 300.0}}, {116.0, {332.0, 332.0}}};
  return scope;
}

// ---- the turn, by what is read

struct Turned : ::testing::Test {
  ScopeTurn turn{angled(), test::angled_lens()};

  static FieldStopReading whole(double deg, double radius_px = 105.0) {
    FieldStopReading reading;
    reading.centre_px = {161.0, 119.0};
    reading.radius_px = radius_px;
    reading.centre_deviation_px = 0.05;
    reading.notch_rad = deg * kDegree;
    reading.notch_deviation_rad = kRead_rad;
    return reading;
  }
  bool frame(double deg) {
    turn.follow(TurnReading{deg * kDegree, kRead_rad});
    return turn.state().has_value();
  }
  bool unread() {
    turn.follow(std::nullopt);
    return turn.state().has_value();
  }
};

TEST_F(Turned, IsKnownOnceACircleIsAndTwoFramesAgree) {
  EXPECT_FALSE(frame(47.0)) << "there is no circle yet";
  EXPECT_FALSE(turn.adopt(whole(47.0), std::nullopt));
  EXPECT_FALSE(turn.state());
  EXPECT_FALSE(frame(47.0));
  EXPECT_TRUE(frame(47.2));
  EXPECT_NEAR(turn.state()->rotation_rad, 47.1 * kDegree, 1e-9);
  const SetupAtRotation expected = angled().at(47.1 * kDegree);
  EXPECT_LT((turn.state()->X_SC.t - expected.X_SC.t).norm(), 1e-9);
  const Vector2d principal = turn.state()->picture.to_picture({170.0, 118.0});
  EXPECT_LT((principal - expected.principal_px).norm(), 1e-9);
}

TEST_F(Turned, FrameWithoutANotchHasNoStateAndTheNextOneHas) {
  turn.adopt(whole(40.0), std::nullopt);
  for (int i = 0; i < 4; ++i) frame(40.0);
  EXPECT_FALSE(unread());
  EXPECT_TRUE(frame(40.0));
}

TEST_F(Turned, WhileItIsTurnedItIsNotKnownAndAfterwardsByTheNewTurnAlone) {
  turn.adopt(whole(40.0), std::nullopt);
  for (int i = 0; i < 20; ++i) frame(40.0);
  for (double deg = 42.0; deg < 70.0; deg += 2.0) EXPECT_FALSE(frame(deg)) << deg;
  EXPECT_FALSE(frame(70.0));
  EXPECT_TRUE(frame(70.0));
  EXPECT_NEAR(turn.state()->rotation_rad, 70.0 * kDegree, 1e-9);
  EXPECT_EQ(turn.turns(), 1U);
}

TEST_F(Turned, SlowlyIsNeverBelievedToBeElsewhereByHalfADegree) {
  turn.adopt(whole(0.0), std::nullopt);
  double deg = 0.0;
  int known = 0;
  for (int i = 0; i < 20; ++i) frame(deg);
  for (int i = 0; i < 400; ++i) {
    deg += 0.12;
    if (!frame(deg)) continue;
    ++known;
    EXPECT_LE(std::abs(turn.state()->rotation_rad / kDegree - deg), 0.5) << i;
  }
  EXPECT_GT(known, 200);
}

TEST_F(Turned, HeldStillIsKnownBetterThanByOneReading) {
  turn.adopt(whole(40.0), std::nullopt);
  for (int i = 0; i < 20; ++i) frame(i % 2 == 0 ? 40.1 : 39.9);
  ASSERT_TRUE(turn.state());
  EXPECT_NEAR(turn.state()->rotation_rad, 40.0 * kDegree, 0.03 * kDegree);
  EXPECT_LT(turn.state()->rotation_deviation_rad, 0.5 * kRead_rad);
  EXPECT_GE(turn.state()->rotation_deviation_rad, kRead_rad / 3.0 - 1e-12);
}

TEST_F(Turned, AcrossHalfATurnIsNoTurnBack) {
  turn.adopt(whole(179.9), std::nullopt);
  frame(179.9);
  EXPECT_TRUE(frame(-179.9));
  EXPECT_NEAR(std::abs(turn.state()->rotation_rad), 180.0 * kDegree, 0.11 * kDegree);
  EXPECT_TRUE(frame(179.95));
}

TEST_F(Turned, WholePictureThatSaysOtherwiseEndsWhatWasBelieved) {
  turn.adopt(whole(40.0), std::nullopt);
  for (int i = 0; i < 6; ++i) frame(40.0);
  const auto seen = turn.seen();
  EXPECT_FALSE(turn.adopt(whole(40.2), seen)) << "it agrees";
  EXPECT_TRUE(turn.adopt(whole(100.0), seen)) << "something else was followed";
  EXPECT_FALSE(frame(100.0));
  EXPECT_TRUE(frame(100.0));
  EXPECT_FALSE(turn.adopt(whole(160.0), std::nullopt)) << "that frame was not told anything";
}

TEST_F(Turned, ZoomIsTakenFromTheTableAndBeyondItNothingIsKnown) {
  turn.adopt(whole(0.0, 110.5), std::nullopt);
  frame(0.0);
  ASSERT_TRUE(frame(0.0));
  EXPECT_NEAR(turn.state()->picture.scale.x(), 316.0 / 300.0, 1e-9);
  // Farther from the middle of turning by as much.
  const Vector2d principal = turn.state()->picture.to_picture({170.0, 118.0});
  EXPECT_NEAR(principal.x(), 161.0 + 9.0 * 316.0 / 300.0, 1e-9);
  const std::uint64_t turns = turn.turns();
  turn.adopt(whole(0.0, 90.0), turn.seen());
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(frame(0.0)) << "of a zoom that nobody calibrated";
  turn.adopt(whole(0.0, 105.0), turn.seen());
  frame(0.0);
  ASSERT_TRUE(frame(0.0));
  EXPECT_NEAR(turn.state()->picture.scale.x(), 1.0, 1e-9);
  EXPECT_EQ(turn.turns(), turns + 1);
}

TEST_F(Turned, GivenUpIsNotKnown) {
  turn.adopt(whole(40.0), std::nullopt);
  for (int i = 0; i < 4; ++i) frame(40.0);
  turn.give_up();
  EXPECT_FALSE(frame(40.0));
}

// ---- a scope whose turns nobody calibrated

TEST(UnchangedScope, IsToldOnceTwoWholePicturesSayOtherwiseAndUntilTheySayAsAtFirst) {
  UnchangedScope scope;
  for (int i = 0; i < 5; ++i) scope.read(Turned::whole(10.0 + 0.1 * i));
  EXPECT_FALSE(scope.changed());
  scope.read(Turned::whole(20.0));
  EXPECT_FALSE(scope.changed()) << "one may be wrong";
  scope.read(Turned::whole(20.1));
  EXPECT_TRUE(scope.changed());
  scope.fail();
  EXPECT_TRUE(scope.changed()) << "what is not read has not been turned back";
  scope.read(Turned::whole(10.3));
  scope.read(Turned::whole(10.2));
  EXPECT_FALSE(scope.changed());
  scope.read(Turned::whole(10.2, 112.0));
  scope.read(Turned::whole(10.2, 112.0));
  EXPECT_TRUE(scope.changed()) << "zoomed";
  EXPECT_EQ(scope.changes(), 2U);
}

TEST(UnchangedScope, SaysNothingOfWhatIsNoFieldStop) {
  UnchangedScope scope;
  for (int i = 0; i < 20; ++i) {
    FieldStopReading elsewhere = Turned::whole(10.0 * i);
    elsewhere.centre_px.x() += 5.0 * i;
    scope.read(elsewhere);
    if (i % 3 == 0) scope.fail();
  }
  EXPECT_FALSE(scope.changed());
}

// ---- through pictures

// A bright round with a notch, 320x240.
std::vector<std::uint8_t> picture_of(double notch_deg, double radius = 105.0) {
  constexpr int kWidth = 320, kHeight = 240;
  std::vector<std::uint8_t> pixels(std::size_t{kWidth} * kHeight);
  const Vector2d along(std::cos(notch_deg * kDegree), std::sin(notch_deg * kDegree));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      // Each pixel's share that is bright, of 16 places.
      int bright = 0;
      for (int k = 0; k < 16; ++k) {
        const Vector2d d(x - 161.0 + (k % 4 - 1.5) / 4.0, y - 119.0 + (k / 4 - 1.5) / 4.0);
        const double radial = d.dot(along);
        const double across = std::abs(d.x() * along.y() - d.y() * along.x());
        const bool notch = radial > radius - 9.0 && across < 0.7 * (radial - (radius - 9.0));
        bright += d.norm() < radius && !notch ? 1 : 0;
      }
      pixels[static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x)] =
          static_cast<std::uint8_t>(6 + 9 * bright);
    }
  }
  return pixels;
}

struct Watched : ::testing::Test {
  PipelineCounters counters;
  ScopeWatch watch;
  std::thread housekeeping{[this] { watch.serve(); }};
  FrameRate rate;
  std::uint64_t frame = 0;
  ScopeWatch::Frame last;

  explicit Watched(bool calibrated = true) : watch(settings(calibrated), counters) {}
  ~Watched() override {
    watch.dismiss();
    housekeeping.join();
  }
  static PipelineSettings settings(bool calibrated) {
    PipelineSettings s;
    s.camera = test::angled_lens();
    s.lockstep = true;
    s.watch_scope = true;
    if (calibrated) s.turned_scope = angled();
    return s;
  }
  // How many of them have a state.
  int frames(int count, const std::vector<std::uint8_t>& pixels) {
    int known = 0;
    for (int i = 0; i < count; ++i) {
      last = watch.begin_frame(frame, Instant(), {pixels.data(), 320, 240, 320});
      known += last.state ? 1 : 0;
      watch.offer(frame++, rate, {pixels.data(), 320, 240, 320});
    }
    return known;
  }
};

TEST_F(Watched, EachFramesNotchTellsItsTurn) {
  frames(10, picture_of(50.0));
  EXPECT_EQ(frames(60, picture_of(50.0)), 60);
  EXPECT_NEAR(last.state->rotation_rad, 50.0 * kDegree, 0.5 * kDegree);
  EXPECT_EQ(counters.scope_read.get(), 1U);
  EXPECT_NEAR(static_cast<double>(counters.scope_rotation_urad.get()), 1e6 * 50.0 * kDegree, 1e4);
  // At once, from the first picture that shows another turn on.
  EXPECT_EQ(frames(1, picture_of(53.0)), 0);
  EXPECT_TRUE(last.unread);
  EXPECT_EQ(counters.scope_read.get(), 0U);
  EXPECT_EQ(frames(9, picture_of(53.0)), 9);
  EXPECT_NEAR(last.state->rotation_rad, 53.0 * kDegree, 0.5 * kDegree);
  // Beyond what a frame looks at a whole reading finds it again.
  EXPECT_EQ(frames(3, picture_of(-120.0)), 0);
  const int found = frames(20, picture_of(-120.0));
  EXPECT_GT(found, 5);
  EXPECT_LT(found, 20);
  EXPECT_NEAR(last.state->rotation_rad, -120.0 * kDegree, 0.5 * kDegree);
  EXPECT_EQ(counters.scope_turns.get(), 2U);
}

TEST_F(Watched, AnotherZoomIsKnownOnceItsCircleIs) {
  frames(40, picture_of(50.0));
  EXPECT_EQ(frames(1, picture_of(50.0, 112.0)), 0) << "the edge is not where it was";
  EXPECT_GT(frames(30, picture_of(50.0, 112.0)), 10);
  const std::vector<std::uint8_t> zoomed = picture_of(50.0, 112.0);
  const auto whole = read_field_stop({zoomed.data(), 320, 240, 320});
  ASSERT_TRUE(whole);
  EXPECT_NEAR(last.state->picture.scale.x(), 1.0 + (whole->radius_px - 105.0) / 11.0 * 32.0 / 300.0, 0.001);
}

TEST_F(Watched, PictureWithoutAFieldStopLeavesNothingKnown) {
  const std::vector<std::uint8_t> grey(std::size_t{320} * 240, 90);
  EXPECT_EQ(frames(90, grey), 0);
  EXPECT_EQ(counters.scope_frames_unread.get(), 90U);
  frames(20, picture_of(50.0));
  EXPECT_TRUE(last.state);
  EXPECT_EQ(frames(20, grey), 0) << "what was read before is not assumed";
}

TEST_F(Turned, FramesTakeNoMemory) {
  const std::vector<std::uint8_t> first = picture_of(50.0), then = picture_of(57.0);
  const auto reading = read_field_stop({first.data(), 320, 240, 320});
  ASSERT_TRUE(reading);
  const long taken = test::allocations_of([&] {
    turn.adopt(*reading, std::nullopt);
    for (int i = 0; i < 40; ++i) turn.look({(i < 20 ? first : then).data(), 320, 240, 320});
  });
  EXPECT_EQ(taken, 0);
  ASSERT_TRUE(turn.state());
  EXPECT_NEAR(turn.state()->rotation_rad, 57.0 * kDegree, 0.5 * kDegree);
}

struct WatchedUncalibrated : Watched {
  WatchedUncalibrated() : Watched(false) {}
};

TEST_F(WatchedUncalibrated, TurnIsToldAndHasNoState) {
  EXPECT_EQ(frames(240, picture_of(50.0)), 0);
  EXPECT_FALSE(last.unread);
  EXPECT_FALSE(last.changed);
  frames(120, picture_of(60.0));
  EXPECT_TRUE(last.changed);
  EXPECT_EQ(counters.scope_changed.get(), 1U);
  frames(120, picture_of(50.0));
  EXPECT_FALSE(last.changed);
}

}  // namespace
}  // namespace perimap
