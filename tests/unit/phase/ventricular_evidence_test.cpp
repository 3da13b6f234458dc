#include "core/phase/ventricular_evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace perimap {
namespace {

// As unlike as usual beats are from each other, on time, in a rhythm that scatters by 3 %.
VentricularEvidence usual() {
  VentricularEvidence evidence;
  evidence.unlike = 0.9;
  evidence.spread = 0.03;
  return evidence;
}

TEST(VentricularEvidence, AnEarlyComplexThatIsUnlikeTheUsualOnesIsVentricularAndAUsualOneIsNot) {
  VentricularEvidence ventricular = usual();
  ventricular.unlike = 30.0;
  ventricular.log_rr = std::log(0.65);
  EXPECT_GT(log_odds(ventricular), 3.0);
  EXPECT_LT(log_odds(usual()), -8.0);
}

TEST(VentricularEvidence, WhatIsFarFromUsualIsVentricularOnTimeOnlyWhereItsKindHasRecurred) {
  VentricularEvidence on_time = usual();
  on_time.unlike = 60.0;
  EXPECT_LT(log_odds(on_time), 0.0);
  on_time.apart = true;
  EXPECT_GT(log_odds(on_time), 0.0);
}

TEST(VentricularEvidence, NothingIsVentricularByOneMeasureAlone) {
  VentricularEvidence unlike = usual();
  unlike.unlike = 1e6;
  EXPECT_LT(log_odds(unlike), 0.0) << "noise";
  VentricularEvidence early = usual();
  early.log_rr = std::log(0.4);
  early.coupled = true;
  EXPECT_LT(log_odds(early), 0.0) << "atrial";
  VentricularEvidence wide = usual();
  wide.narrower = -2.0;
  wide.recurs = true;
  EXPECT_LT(log_odds(wide), 0.0) << "a bundle branch";
  wide.after_one = true;
  wide.kind_log_rr = -0.3;
  EXPECT_LT(log_odds(wide), 0.0) << "a bundle branch, after a ventricular beat";
}

// It is conducted: beside the wide beats of a pacemaker, or of a bundle branch block.
TEST(VentricularEvidence, WhatIsNarrowerThanTheUsualBeatIsLessLikelyVentricular) {
  VentricularEvidence beat = usual();
  beat.unlike = 30.0;
  beat.log_rr = -0.1;
  const double as_wide = log_odds(beat);
  beat.narrower = 0.4;
  EXPECT_LT(log_odds(beat), as_wide - 1.0);
  beat.narrower = -0.4;
  EXPECT_EQ(log_odds(beat), as_wide) << "what is seen for the first time may be noise";
  beat.recurs = true;
  EXPECT_GT(log_odds(beat), as_wide + 1.0);
}

// As where two kinds of ventricular beats alternate, one of which comes on time.
TEST(VentricularEvidence, AWiderBeatRightAfterAVentricularOneIsMoreLikelyOne) {
  const auto worth = [](double narrower, bool recurs, double kind_log_rr = -0.1) {
    VentricularEvidence beat = usual();
    beat.unlike = 30.0;
    beat.narrower = narrower;
    beat.recurs = recurs;
    beat.kind_log_rr = kind_log_rr;
    const double after_a_usual_one = log_odds(beat);
    beat.after_one = true;
    return log_odds(beat) - after_a_usual_one;
  };
  EXPECT_NEAR(worth(-0.3, true), 4.0, 0.5);
  EXPECT_NEAR(worth(-0.05, true), 2.0, 0.4);
  EXPECT_EQ(worth(0.1, true), 0.0) << "conducted";
  EXPECT_EQ(worth(-0.3, true, -0.06), 0.0) << "a bundle branch";
  EXPECT_EQ(worth(-0.3, false), 0.0) << "what is seen for the first time may be noise";
}

TEST(VentricularEvidence, BesideAPacemakersBeatsWhatIsNarrowAndNotFarTooEarlyIsTheHeartsOwn) {
  VentricularEvidence own = usual();
  own.unlike = 60.0;
  own.log_rr = -0.2;
  own.spread = 0.003;
  own.narrower = 0.2;
  own.coupled = true;
  EXPECT_GT(log_odds(own), 0.0);
  EXPECT_EQ(own_of_paced(own), 0.0);
  own.paced = true;
  EXPECT_LT(log_odds(own), 0.0);
  EXPECT_EQ(own_of_paced(own), 1.0);
  VentricularEvidence wide = own;
  wide.narrower = -0.1;
  EXPECT_GT(log_odds(wide), 0.0);
  VentricularEvidence early = own;
  early.log_rr = std::log(0.55);
  EXPECT_GT(log_odds(early), 0.0);
}

TEST(VentricularEvidence, HowFarABeatIsTheHeartsOwnRisesWithItsWidthAndItsTime) {
  VentricularEvidence own = usual();
  own.paced = true;
  own.log_rr = -0.3;
  own.narrower = 0.3;
  EXPECT_NEAR(own_of_paced(own), 0.5, 0.02);
  own.log_rr = 0.0;
  own.narrower = 0.075;
  EXPECT_NEAR(own_of_paced(own), 0.5, 0.02);
}

// Fibrillation, which ventricular beats do not come by: they keep a distance of their own from the beat before.
TEST(VentricularEvidence, AKindThatComesAtAnyTimeIsAPacedHeartsOwnHoweverEarly) {
  VentricularEvidence own = usual();
  own.paced = true;
  own.narrower = 0.3;
  own.log_rr = -0.6;
  EXPECT_EQ(own_of_paced(own), 0.0);
  own.kind_log_rr = -0.2;
  own.kind_scatter = 0.15;
  EXPECT_EQ(own_of_paced(own), 1.0);
  own.kind_scatter = 0.105;
  EXPECT_NEAR(own_of_paced(own), 0.5, 0.02);
  own.kind_scatter = 0.07;
  EXPECT_EQ(own_of_paced(own), 0.0) << "coupled";
  own.kind_scatter = 0.15;
  own.kind_log_rr = -0.375;
  EXPECT_NEAR(own_of_paced(own), 0.5, 0.02);
  own.kind_log_rr = -0.5;
  EXPECT_EQ(own_of_paced(own), 0.0) << "its kind comes early on the mean";
  own.log_rr = 0.0;
  EXPECT_EQ(own_of_paced(own), 1.0) << "in time by itself";
}

// In natural units of log odds, as fitted to the development records.
TEST(VentricularEvidence, IsWorthWhatTheRecordsSay) {
  const double base = log_odds(usual());
  EXPECT_NEAR(base, -8.75, 0.1);
  struct {
    const char* name;
    std::function<void(VentricularEvidence&)> change;
    double log_odds;
  } const all[] = {
      {"less unlike than most usual ones", [](auto& e) { e.unlike = 0.1; }, 0.0},
      {"four times e as unlike", [](auto& e) { e.unlike = 4.0 * std::exp(1.0); }, 4.3},
      {"as noise is", [](auto& e) { e.unlike = 60.0; }, 8.7},
      {"more than that", [](auto& e) { e.unlike = 1e5; }, 8.7},
      {"early by two deviations", [](auto& e) { e.log_rr = -0.12; }, 2.7},
      {"by six", [](auto& e) { e.log_rr = -0.36; }, 5.4},
      {"as early, where the rhythm scatters", [](auto& e) { e.log_rr = -0.36, e.spread = 0.21; }, 2.0},
      {"late", [](auto& e) { e.log_rr = 0.5; }, -1.35},
      {"after a cycle that was as short", [](auto& e) { e.log_rr_before = std::log(2.0 / 3.0); }, -1.14},
      {"after a pause", [](auto& e) { e.log_rr_before = 1.5; }, 1.96},
      {"of another kind that has recurred", [](auto& e) { e.apart = true; }, 1.8},
      {"narrower", [](auto& e) { e.narrower = 0.2; }, -0.64},
      {"far narrower", [](auto& e) { e.narrower = 2.0; }, -1.6},
      {"wider", [](auto& e) { e.narrower = -0.2, e.recurs = true; }, 0.6},
      {"far wider", [](auto& e) { e.narrower = -2.0, e.recurs = true; }, 1.5},
      {"among a pacemaker's beats", [](auto& e) { e.paced = true; }, -1.0},
      {"half of a paced heart's own", [](auto& e) { e.narrower = 0.075, e.paced = true; }, -5.24},
      {"of a kind that comes so", [](auto& e) { e.coupled = true; }, 3.1},
  };
  for (const auto& worth : all) {
    VentricularEvidence evidence = usual();
    worth.change(evidence);
    EXPECT_NEAR(log_odds(evidence) - base, worth.log_odds, 0.1 * std::abs(worth.log_odds) + 1e-9) << worth.name;
  }
}

}  // namespace
}  // namespace perimap
