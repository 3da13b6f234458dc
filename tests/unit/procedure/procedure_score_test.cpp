#include "daemon/evaluation/procedure/procedure_score.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "daemon/evaluation/procedure/event_causes.hpp"
#include "daemon/evaluation/procedure/procedure_text.hpp"

namespace perimap {
namespace {

// Ten surfaces a second of 200 features, good and right from the beginning.
std::vector<JudgedSurface> session(double length_s, const std::function<void(JudgedSurface&)>& change = {}) {
  std::vector<JudgedSurface> surfaces;
  for (int i = 0; i < static_cast<int>(std::lround(10.0 * length_s)); ++i) {
    JudgedSurface surface;
    surface.released_s = 0.1 * i;
    surface.state = perimap_SURFACE_GOOD;
    surface.once_converged = surface.good = 200;
    if (change) change(surface);
    surfaces.push_back(surface);
  }
  return surfaces;
}

void degrade(JudgedSurface& surface, perimap_SurfaceReason reason) {
  surface.state = perimap_SURFACE_DEGRADED;
  surface.reason = reason;
  surface.good = 0;
}

bool is_between(const JudgedSurface& surface, double begin_s, double end_s) {
  return surface.released_s > begin_s - 0.05 && surface.released_s < end_s - 0.05;
}

const std::vector<double> kEven = [] {
  std::vector<double> r_peaks;
  for (int i = 0; i < 200; ++i) r_peaks.push_back(0.8 * i);
  return r_peaks;
}();

TEST(ProcedureScore, OfASessionThatIsGoodAndRightThroughoutIsFaultless) {
  const ProcedureScore score = score_procedure(session(100.0), {{"dent", "dent", 40.0, 44.0, false}}, kEven);
  EXPECT_NEAR(score.availability, 1.0, 1e-9);
  EXPECT_NEAR(score.duration_s, 99.9, 1e-6);
  EXPECT_TRUE(score.false_alarms.empty());
  EXPECT_EQ(score.wrong_while_good_s, 0.0);
  ASSERT_EQ(score.events.size(), 1U);
  EXPECT_FALSE(score.events[0].told_after_s);
  EXPECT_FALSE(score.events[0].right) << "of a dent nothing need be said";
  EXPECT_NEAR(score.events[0].good_again_after_s.value(), 0.0, 0.11);
  EXPECT_EQ(score.causes_judged, 0U);
  EXPECT_TRUE(std::isnan(score.cause_accuracy()));
}

TEST(ProcedureScore, ASessionWithoutSurfacesHasNoFigures) {
  EXPECT_EQ(score_procedure({}, {{"dent", "dent", 1.0, 2.0, false}}, kEven).duration_s, 0.0);
}

TEST(ProcedureScore, WhatIsSeenAndNotGoodIsNotAvailableAndWhatIsHiddenDoesNotCount) {
  // Hidden for 20 s, not good for those and 10 more.
  const auto surfaces = session(100.0, [](JudgedSurface& s) {
    if (is_between(s, 40.0, 70.0)) degrade(s, perimap_SURFACE_REASON_NOT_SEEN);
  });
  const ProcedureScore score = score_procedure(surfaces, {{"withdrawn", "withdrawn", 40.0, 60.0, true}}, kEven);
  EXPECT_NEAR(score.seen_s, 79.9, 0.15);
  EXPECT_NEAR(score.availability, 69.9 / 79.9, 2e-3);
  ASSERT_EQ(score.events.size(), 1U);
  EXPECT_NEAR(score.events[0].told_after_s.value(), 0.0, 0.11);
  EXPECT_EQ(score.events[0].cause, perimap_SURFACE_REASON_NOT_SEEN);
  EXPECT_EQ(score.events[0].right, true);
  EXPECT_NEAR(score.events[0].good_again_after_s.value(), 10.0, 0.11);
  EXPECT_EQ(score.events_to_recover, 1U);
  EXPECT_EQ(score.events_recovered, 0U) << "three seconds after a withdrawal";
  EXPECT_EQ(score.cause_accuracy(), 1.0);
}

TEST(ProcedureScore, HalfTheFeaturesAreHalfAvailable) {
  const auto surfaces = session(50.0, [](JudgedSurface& s) { s.good = 100; });
  EXPECT_NEAR(score_procedure(surfaces, {}, kEven).availability, 0.5, 1e-9);
}

TEST(ProcedureScore, WhatIsBeforeTheFirstGoodSurfaceDoesNotCountForThirtySecondsAtMost) {
  const auto until = [](double s) {
    return session(100.0, [s](JudgedSurface& surface) {
      if (surface.released_s < s) degrade(surface, perimap_SURFACE_REASON_NOTHING_CONVERGED);
    });
  };
  EXPECT_NEAR(score_procedure(until(20.0), {}, kEven).availability, 1.0, 1e-9);
  EXPECT_TRUE(score_procedure(until(20.0), {}, kEven).false_alarms.empty());
  EXPECT_NEAR(score_procedure(until(65.0), {}, kEven).availability, 0.5, 0.01);
}

TEST(ProcedureScore, MoreThanOnePercentOffIsWrongAtOnceAndOneFeatureAfterAFifthOfASecond) {
  const auto off = [](std::size_t features, double length_s) {
    return session(60.0, [=](JudgedSurface& s) {
      if (!is_between(s, 40.0, 40.0 + length_s)) return;
      for (std::uint32_t id = 0; id < features; ++id) s.good_ids_off.push_back(id);
      s.largest_good_mm = 4.0;
    });
  };
  const auto wrong_s = [](const std::vector<JudgedSurface>& surfaces) {
    return score_procedure(surfaces, {}, kEven).wrong_while_good_s;
  };
  EXPECT_NEAR(wrong_s(off(3, 1.0)), 1.0, 1e-6) << "3 of 200";
  EXPECT_NEAR(wrong_s(off(2, 0.2)), 0.0, 1e-6) << "2 of 200, for 0.2 s";
  EXPECT_NEAR(wrong_s(off(1, 1.0)), 0.7, 1e-6) << "the surfaces after the first 0.2 s";
}

TEST(ProcedureScore, AnotherFeatureEachTimeIsNotOneFeature) {
  const auto surfaces = session(60.0, [](JudgedSurface& s) {
    if (is_between(s, 40.0, 42.0))
      s.good_ids_off.push_back(static_cast<std::uint32_t>(std::lround(10.0 * s.released_s)));
  });
  EXPECT_EQ(score_procedure(surfaces, {}, kEven).wrong_while_good_s, 0.0);
}

TEST(ProcedureScore, WhatIsWrongIsCountedWithItsEventAndInTheWorstTenSeconds) {
  const auto surfaces = session(100.0, [](JudgedSurface& s) {
    if (!is_between(s, 52.0, 57.0)) return;
    s.good_ids_off.assign(200, 0);
    s.largest_good_mm = 6.5;
    s.before_known = s.released_s < 52.95;
  });
  const ProcedureScore score =
      score_procedure(surfaces, {{"retraction", "a", 50.0, 52.0, false}, {"dent", "b", 80.0, 82.0, false}}, kEven);
  EXPECT_NEAR(score.events[0].wrong_while_good_s, 5.0, 1e-6);
  EXPECT_EQ(score.events[1].wrong_while_good_s, 0.0);
  EXPECT_EQ(score.events[0].right, false) << "of a moved organ must be told";
  EXPECT_NEAR(score.worst_ten_seconds.wrong_s, 5.0, 1e-6);
  EXPECT_EQ(score.worst_ten_seconds.largest_mm, 6.5);
  EXPECT_NEAR(score.wrong_before_known_s, 1.0, 1e-6);
}

TEST(ProcedureScore, AnAlarmFarFromAnyEventIsFalseAndOneThatFlickersIsOne) {
  const auto surfaces = session(100.0, [](JudgedSurface& s) {
    if (is_between(s, 70.0, 71.0) || is_between(s, 71.5, 72.0) || is_between(s, 90.0, 90.5)) {
      degrade(s, perimap_SURFACE_REASON_SETUP_DOUBTED);
    }
    if (is_between(s, 58.0, 59.0)) degrade(s, perimap_SURFACE_REASON_NOT_SEEN);
  });
  const ProcedureScore score = score_procedure(surfaces, {{"dent", "dent", 45.0, 50.0, false}}, kEven);
  ASSERT_EQ(score.false_alarms.size(), 2U) << "8 s after the event one still tells of it";
  EXPECT_NEAR(score.false_alarms[0].begin_s, 70.0, 1e-6);
  EXPECT_NEAR(score.false_alarms[0].end_s, 71.9, 1e-6);
  EXPECT_EQ(score.false_alarms[0].reason, perimap_SURFACE_REASON_SETUP_DOUBTED);
  EXPECT_NEAR(score.false_alarms_per_hour(), 2.0 * 3600.0 / 99.9, 1e-6);
}

TEST(ProcedureScore, AnAlarmAboutPositionsThatAreOffIsNotFalse) {
  const auto surfaces = session(100.0, [](JudgedSurface& s) {
    if (!is_between(s, 70.0, 75.0)) return;
    degrade(s, perimap_SURFACE_REASON_SETUP_DOUBTED);
    s.once_converged_off = 50;
  });
  EXPECT_TRUE(score_procedure(surfaces, {}, kEven).false_alarms.empty());
}

TEST(ProcedureScore, AnEctopicBeatIsToldRightlyWhereABeatComesEarlyAndFalselyElsewhere) {
  std::vector<double> r_peaks = kEven;
  r_peaks[50] -= 0.3;  // at 39.7 s
  const auto surfaces = session(100.0, [](JudgedSurface& s) {
    if (is_between(s, 39.8, 41.0) || is_between(s, 60.0, 61.0)) degrade(s, perimap_SURFACE_REASON_ECTOPIC_BEAT);
  });
  const ProcedureScore score = score_procedure(surfaces, {}, r_peaks);
  ASSERT_EQ(score.false_alarms.size(), 1U);
  EXPECT_NEAR(score.false_alarms[0].begin_s, 60.0, 1e-6);
}

TEST(ProcedureScore, TheCauseIsWhatIsSaidLongest) {
  const auto surfaces = session(100.0, [](JudgedSurface& s) {
    if (is_between(s, 50.0, 51.0)) degrade(s, perimap_SURFACE_REASON_POSE_MISSING);
    if (is_between(s, 51.0, 54.0)) degrade(s, perimap_SURFACE_REASON_NOT_SEEN);
  });
  const ProcedureScore score = score_procedure(
      surfaces, {{"tool-hidden", "a", 49.0, 53.0, false}, {"leads-off", "b", 70.0, 75.0, false}}, kEven);
  EXPECT_EQ(score.events[0].cause, perimap_SURFACE_REASON_NOT_SEEN);
  EXPECT_EQ(score.events[0].right, false);
  EXPECT_NEAR(score.events[0].told_after_s.value(), 1.0, 0.11);
  EXPECT_EQ(score.events[1].right, false) << "nothing was said of what must be told";
  EXPECT_EQ(score.causes_judged, 2U);
  EXPECT_EQ(score.cause_accuracy(), 0.0);
}

TEST(ProcedureScore, WhatIsNotGoodAgainBeforeTheNextEventHasNoFigureAndIsRecoveredOnlyWhereThereWasTime) {
  const auto surfaces = session(100.0, [](JudgedSurface& s) {
    if (is_between(s, 40.0, 70.0)) degrade(s, perimap_SURFACE_REASON_NOT_SEEN);
  });
  const ProcedureScore score = score_procedure(
      surfaces, {{"smoke", "a", 40.0, 45.0, true}, {"smoke", "b", 50.0, 55.0, true}, {"smoke", "c", 69.0, 71.0, true}},
      kEven);
  EXPECT_FALSE(score.events[0].good_again_after_s);
  EXPECT_FALSE(score.events[1].good_again_after_s);
  EXPECT_EQ(score.events_to_recover, 2U) << "five seconds are too few to tell";
  EXPECT_EQ(score.events_recovered, 1U);
}

TEST(ProcedureScore, GoodForAMomentOrWithAFewFeaturesIsNotGoodAgain) {
  const auto surfaces = session(100.0, [](JudgedSurface& s) {
    if (is_between(s, 40.0, 45.0) || is_between(s, 46.0, 47.0)) degrade(s, perimap_SURFACE_REASON_NOT_SEEN);
    if (is_between(s, 47.0, 50.0)) s.good = 20;
  });
  const ProcedureScore score = score_procedure(surfaces, {{"smoke", "a", 40.0, 44.0, true}}, kEven);
  EXPECT_NEAR(score.events[0].good_again_after_s.value(), 6.0, 0.11);
}

TEST(ProcedureScore, IsTheSameInJsonUnderTheKeysThatProgramsRead) {
  const auto surfaces = session(60.0, [](JudgedSurface& s) {
    if (is_between(s, 40.0, 45.0)) degrade(s, perimap_SURFACE_REASON_NOT_SEEN);
  });
  const ProcedureScore score = score_procedure(surfaces, {{"smoke", "smoke: density = 2.0", 40.0, 44.0, true}}, kEven);
  const nlohmann::json json = to_json(score);
  EXPECT_EQ(json["availability"], score.availability);
  EXPECT_EQ(json["false_alarms_per_hour"], 0.0);
  EXPECT_EQ(json["wrong_while_good_s"], 0.0);
  EXPECT_EQ(json["cause_accuracy"], 1.0);
  ASSERT_EQ(json["events"].size(), 1U);
  EXPECT_EQ(json["events"][0]["cause"], "not_seen");
  EXPECT_NE(to_text(score).find("smoke: density = 2.0"), std::string::npos);
}

TEST(EventCauses, OfAKindThatNobodyKnowsNothingMustBeTold) {
  EXPECT_FALSE(causes_of("earthquake", false).must_be_told);
  EXPECT_TRUE(causes_of("withdrawn", true).must_be_told);
  EXPECT_FALSE(causes_of("smoke", false).must_be_told);
}

}  // namespace
}  // namespace perimap
