// core/calibration/held_stretches: readings of a notch that is held, turned and misread.
#include "core/calibration/held_stretches.hpp"

#include <gtest/gtest.h>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

class Readings : public testing::Test {
 protected:
  // Four a second.
  void hold(double notch_deg, double for_s) { turn(notch_deg, notch_deg, for_s); }
  void zoom(double from_px, double to_px, double within_s) {
    const int count = static_cast<int>(4.0 * within_s);
    for (int i = 0; i < count; ++i) {
      const double radius_px = from_px + (i + 1.0) / count * (to_px - from_px) + (i % 2 == 0 ? 0.3 : -0.3);
      stretches_.add({t_s_, orientation_of_notch(0.2), radius_px});
      t_s_ += 0.25;
    }
  }
  void turn(double from_deg, double to_deg, double within_s) {
    const int count = static_cast<int>(4.0 * within_s);
    for (int i = 0; i < count; ++i) {
      const double share = (i + 1.0) / count;
      // A degree of noise, of one sign and the other.
      const double noise_deg = i % 2 == 0 ? 0.7 : -0.7;
      stretches_.add({t_s_, orientation_of_notch((from_deg + share * (to_deg - from_deg) + noise_deg) * kDegree)});
      t_s_ += 0.25;
    }
  }
  [[nodiscard]] double angle_deg(std::size_t stretch, double notch_deg) const {
    return angle_between(stretches_.stretches().at(stretch).R, orientation_of_notch(notch_deg * kDegree)) / kDegree;
  }

  HeldStretches stretches_;
  double t_s_ = 100.0;
};

TEST_F(Readings, EachTurnAtWhichTheScopeIsHeldIsAStretch) {
  hold(10.0, 20.0);
  turn(10.0, 85.0, 2.0);
  hold(85.0, 20.0);
  turn(85.0, 190.0, 2.0);  // on over half a turn
  hold(190.0, 20.0);
  ASSERT_EQ(stretches_.stretches().size(), 3U);
  EXPECT_TRUE(stretches_.is_held());
  EXPECT_LT(angle_deg(0, 10.0), 0.3);
  EXPECT_LT(angle_deg(1, 85.0), 0.3);
  EXPECT_LT(angle_deg(2, -170.0), 0.3);
  EXPECT_NEAR(stretches_.stretches()[0].to_s, 120.0, 0.6);
  EXPECT_NEAR(stretches_.stretches()[1].from_s, 122.0, 0.6);
}

TEST_F(Readings, OneThatIsMisreadEndsNoStretch) {
  hold(10.0, 5.0);
  hold(120.0, 0.5);
  hold(10.0, 5.0);
  EXPECT_EQ(stretches_.stretches().size(), 1U);
  EXPECT_NEAR(stretches_.stretches()[0].to_s, t_s_ - 0.25, 1e-9);
}

TEST_F(Readings, TurnedAwayAndBackItIsHeldTwice) {
  hold(10.0, 15.0);
  turn(10.0, 90.0, 3.0);
  turn(90.0, 10.0, 3.0);
  hold(10.0, 15.0);
  ASSERT_EQ(stretches_.stretches().size(), 2U);
  EXPECT_NEAR(stretches_.stretches()[0].to_s, 115.0, 0.6);
  EXPECT_NEAR(stretches_.stretches()[1].from_s, 121.0, 0.6);
}

TEST_F(Readings, AnotherZoomAtTheSameTurnIsAStretchOfItsOwn) {
  zoom(200.0, 200.0, 15.0);
  zoom(200.0, 230.0, 2.0);
  EXPECT_FALSE(stretches_.is_held());
  zoom(230.0, 230.0, 15.0);
  ASSERT_EQ(stretches_.stretches().size(), 2U);
  EXPECT_NEAR(stretches_.stretches()[0].radius_px, 200.0, 0.2);
  EXPECT_NEAR(stretches_.stretches()[1].radius_px, 230.0, 0.2);
}

TEST_F(Readings, TheZoomOfTheTurnsIsTheFirstThatIsHeldLongEnough) {
  EXPECT_EQ(radius_of_turns_px(stretches_.stretches()), 0.0);
  zoom(230.0, 230.0, 3.0);
  EXPECT_NEAR(radius_of_turns_px(stretches_.stretches()), 230.0, 0.3) << "the last one, while none is long enough";
  zoom(230.0, 200.0, 2.0);
  zoom(200.0, 200.0, 15.0);
  zoom(200.0, 230.0, 2.0);
  zoom(230.0, 230.0, 20.0);
  EXPECT_NEAR(radius_of_turns_px(stretches_.stretches()), 200.0, 0.3);
}

TEST_F(Readings, WhileTheScopeIsTurnedItIsNotHeld) {
  hold(10.0, 5.0);
  turn(10.0, 40.0, 0.5);
  EXPECT_FALSE(stretches_.is_held());
}

}  // namespace
}  // namespace perimap
