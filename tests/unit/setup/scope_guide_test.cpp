// What a user is told while an angled scope is measured at several turns and zooms, by drawn field stops; and whether
// the tracker sees what is needed.
#include "daemon/setup/scope_guide.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/turned_scope.hpp"
#include "daemon/setup/sight_of_tools.hpp"

namespace perimap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

constexpr int kWidth = 320;
constexpr int kHeight = 240;

// White within a circle that has a notch; there is no board in it.
std::vector<std::uint8_t> field_stop(double notch_deg, double radius_px) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Vector2d from(x - 160.0, y - 120.0);
      const double turn =
          std::abs(std::remainder(std::atan2(from.y(), from.x()) - notch_deg * kDegree, 2.0 * std::numbers::pi));
      const double edge = radius_px - 9.0 * std::max(0.0, 1.0 - turn / 0.06);
      pixels.push_back(static_cast<std::uint8_t>(10.0 + 120.0 * std::clamp(0.5 + edge - from.norm(), 0.0, 1.0)));
    }
  }
  return pixels;
}

class ScopeGuide : public testing::Test {
 protected:
  void guided_by(std::size_t turns, std::size_t zooms) {
    BoardWish wish;
    wish.square_mm = 8.0;
    guide_ = scope_guide({wish, turns, zooms, 25.0, false});
  }
  // Four pictures a second.
  void hold(double notch_deg, double radius_px, double for_s) {
    const auto pixels = field_stop(notch_deg, radius_px);
    for (double end_s = t_s_ + for_s; t_s_ < end_s; t_s_ += 0.25) {
      guide_->see(t_s_, {pixels.data(), kWidth, kHeight, kWidth});
    }
  }

  std::unique_ptr<LiveGuide> guide_;
  double t_s_ = 50.0;
};

TEST_F(ScopeGuide, SaysWhetherItIsATurnOrAZoomAtWhichTheScopeIsHeld) {
  guided_by(2, 1);
  EXPECT_THAT(guide_->line(), HasSubstr("0 of 2 turns and 0 of 1 other zooms are enough; hold the scope at one turn"));
  hold(10.0, 90.0, 13.0);
  EXPECT_THAT(guide_->line(), StartsWith("turn 1 of 2: no board is seen"));
  hold(10.0, 100.0, 3.0);
  EXPECT_THAT(guide_->line(), StartsWith("zoom 1 of 1: no board is seen"));
  hold(95.0, 90.0, 3.0);
  EXPECT_THAT(guide_->line(), StartsWith("turn 1 of 2: no board is seen"));
  EXPECT_FALSE(guide_->enough());
}

TEST_F(ScopeGuide, AZoomThatNobodyAskedForIsNoTurn) {
  guided_by(2, 0);
  hold(10.0, 90.0, 13.0);
  hold(10.0, 100.0, 3.0);
  EXPECT_THAT(guide_->line(), AllOf(HasSubstr("of another zoom than the first turn: zoom back"), HasSubstr("--zooms")));
  hold(10.0, 90.0, 3.0);
  EXPECT_THAT(guide_->line(), StartsWith("turn 1 of 2: "));
}

TEST_F(ScopeGuide, TheZoomOfTheTurnsIsTheFirstOneThatIsHeldLongEnough) {
  guided_by(2, 1);
  hold(10.0, 100.0, 3.0);
  hold(10.0, 90.0, 13.0);
  EXPECT_THAT(guide_->line(), StartsWith("turn 1 of 2: "));
  hold(10.0, 100.0, 3.0);
  EXPECT_THAT(guide_->line(), StartsWith("zoom 1 of 1: "));
}

TEST_F(ScopeGuide, WithoutAFieldStopSaysSo) {
  guided_by(3, 0);
  const std::vector<std::uint8_t> flat(static_cast<std::size_t>(kWidth) * kHeight, 90);
  guide_->see(t_s_, {flat.data(), kWidth, kHeight, kWidth});
  EXPECT_THAT(guide_->line(), StartsWith("the field stop is not read: "));
}

// ---- whether the tracker sees what is needed

class Sight : public testing::Test {
 protected:
  static Instant at(double t_s) { return Instant(from_seconds(t_s)); }
  static TrackerSample reading(ToolState state, double t_s) {
    TrackerSample sample;
    sample.state = state;
    sample.arrival = at(t_s);
    return sample;
  }
};

TEST_F(Sight, OfAllToolsHasNothingToSay) {
  SightOfTools sight({"the sensor", "the second sensor"}, at(10.0));
  EXPECT_THAT(sight.missing(at(10.9)), IsEmpty());
  sight.take(0, reading(ToolState::kOk, 13.0));
  sight.take(1, reading(ToolState::kOk, 13.5));
  EXPECT_THAT(sight.missing(at(13.9)), IsEmpty());
}

TEST_F(Sight, OfALostToolNamesItAndSaysForHowLong) {
  SightOfTools sight({"the sensor", "the second sensor"}, at(10.0));
  for (double t_s = 10.0; t_s < 20.0; t_s += 0.1) {
    sight.take(0, reading(ToolState::kOk, t_s));
    sight.take(1, reading(t_s < 15.05 ? ToolState::kOk : ToolState::kMissing, t_s));
  }
  EXPECT_THAT(sight.missing(at(20.0)),
              AllOf(StartsWith("the second sensor has not been seen for 5 s: bring it into sight of the tracker"),
                    Not(HasSubstr("the sensor has"))));
  sight.take(1, reading(ToolState::kOk, 20.0));
  EXPECT_THAT(sight.missing(at(20.1)), IsEmpty());
}

TEST_F(Sight, OfAToolThatNeverCameIsMissedToo) {
  const SightOfTools sight({"the tool 'pointer'"}, at(10.0));
  EXPECT_THAT(sight.missing(at(12.0)), HasSubstr("the tool 'pointer' has not been seen for 2 s"));
}

}  // namespace
}  // namespace perimap
