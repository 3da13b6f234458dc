// What two leads tell, made up beat by beat: every decision and constant of the agreement, by what a user would see.
#include "core/phase/lead_agreement.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace perimap::test {
namespace {

constexpr double kStep_s = 0.001;
constexpr double kDelay_s = 0.09;  // of a detector
constexpr double kCycle_s = 0.8;

Instant at(double t_s) { return Instant(from_seconds(t_s)); }
double seconds(Instant t) { return to_seconds(t.time_since_epoch()); }

// Two detectors that tell what the test says.
struct Leads {
  LeadAgreement agreement;
  std::array<EcgSignal, 2> signals{EcgSignal::kGood, EcgSignal::kGood};
  std::array<Pondered, 2> pondered{Pondered::kNothing, Pondered::kNothing};
  std::vector<LeadBeat> told;
  double now_s = 10.0;
  double last_s = 0.0;  // the last beat

  // Both have been heard well for so long.
  explicit Leads(double heard_s = 3.0) {
    run(now_s + heard_s);
    last_s = now_s;
  }

  void decide() {
    while (const auto beat = agreement.decide(
               false, [&](int lead, Instant, Duration) { return pondered[static_cast<std::size_t>(lead)]; })) {
      told.push_back(*beat);
    }
  }
  void run(double until_s) {
    for (; now_s < until_s - 1e-9; now_s += kStep_s) {
      agreement.hear(at(now_s), signals);
      decide();
    }
  }
  void tells(int lead, double at_s, double confidence = 0.99) {
    run(at_s + kDelay_s);
    take(lead, at_s, confidence);
    decide();
    last_s = std::max(last_s, at_s);
  }
  void take(int lead, double at_s, double confidence) {
    RPeak peak;
    peak.time = at(at_s);
    peak.confidence = confidence;
    peak.shape.points = 28;
    agreement.hear(lead, peak);
  }
  // Both tell a beat, the second one's peak later, when both are known.
  void both(double at_s, double later_s, std::array<double, 2> confidence = {0.99, 0.99}) {
    run(at_s + std::max(later_s, 0.0) + kDelay_s);
    for (int lead = 0; lead < 2; ++lead)
      take(lead, lead == 0 ? at_s : at_s + later_s, confidence[static_cast<std::size_t>(lead)]);
    decide();
    last_s = at_s;
  }
  // So many beats, which both tell unless the confidence is none.
  void beats(int count, std::array<std::optional<double>, 2> confidence = {0.99, 0.99}) {
    for (int i = 0; i < count; ++i) {
      const double at_s = last_s + kCycle_s;
      for (int lead = 0; lead < 2; ++lead) {
        if (const auto& sure = confidence[static_cast<std::size_t>(lead)]) tells(lead, at_s, *sure);
      }
    }
    run(last_s + 0.3);
  }
  // What is told of that instant, once it may be known.
  std::optional<LeadBeat> told_at(double at_s) {
    run(at_s + 0.5);
    std::optional<LeadBeat> found;
    for (const LeadBeat& beat : told) {
      if (std::abs(seconds(beat.peak.time) - at_s) < 0.05) found = beat;
    }
    return found;
  }
  // The confidence of what that lead alone tells next, after so many cycles; 0 where it is passed over.
  double alone(int lead, double confidence, double cycles = 1.0) {
    const double at_s = last_s + cycles * kCycle_s;
    tells(lead, at_s, confidence);
    const auto beat = told_at(at_s);
    return beat ? beat->peak.confidence : 0.0;
  }
};

bool of_both(const LeadBeat& beat) { return beat.shapes[0].points > 0 && beat.shapes[1].points > 0; }

TEST(LeadAgreement, WhatBothTellIsOneBeatAsSureAsTheSurerOfTwoThatAreHeardWell) {
  Leads leads;
  leads.tells(0, 14.0, 0.6);
  leads.tells(1, 14.0, 0.9);
  const auto beat = leads.told_at(14.0);
  ASSERT_TRUE(beat);
  EXPECT_TRUE(of_both(*beat));
  EXPECT_EQ(beat->peak.confidence, 0.9);
  EXPECT_EQ(leads.told.size(), 1U);
}

TEST(LeadAgreement, WhatBothTellIsAsSureAndComesWhenTheLeadSaysThatIsHeardWell) {
  for (const int disturbed : {0, 1}) {
    Leads leads;
    leads.beats(20);
    leads.signals[static_cast<std::size_t>(disturbed)] = EcgSignal::kNoisy;
    leads.run(leads.now_s + 0.1);
    EXPECT_EQ(leads.agreement.leading(), 0);
    leads.both(leads.last_s + kCycle_s, 0.0, disturbed == 0 ? std::array{0.95, 0.6} : std::array{0.6, 0.95});
    EXPECT_EQ(leads.told.back().peak.confidence, 0.6);
    EXPECT_EQ(leads.told.back().lead, 1 - disturbed);
  }
}

TEST(LeadAgreement, WhatADisturbedLeadAloneTellsBesideOneThatIsHeardWellIsPassedOver) {
  Leads leads;
  leads.beats(20);
  leads.signals[0] = EcgSignal::kNoisy;
  leads.run(leads.now_s + 0.1);
  EXPECT_EQ(leads.agreement.leading(), 0);
  EXPECT_EQ(leads.alone(0, 1.0), 0.0);
}

TEST(LeadAgreement, BeatsAreToldInOrderOfTime) {
  Leads leads;
  leads.run(14.7);
  leads.take(0, 14.6, 0.99);
  leads.take(0, 14.2, 0.99);
  leads.run(15.0);
  ASSERT_EQ(leads.told.size(), 2U);
  EXPECT_LT(leads.told[0].peak.time, leads.told[1].peak.time);
}

TEST(LeadAgreement, PeaksOfOneComplexLieUpTo120msApart) {
  for (const double apart_s : {0.11, 0.13}) {
    Leads leads;
    leads.both(14.0, apart_s);
    leads.run(15.0);
    ASSERT_EQ(leads.told.size(), 1U) << apart_s;
    EXPECT_EQ(of_both(leads.told[0]), apart_s < 0.12) << apart_s;
  }
}

TEST(LeadAgreement, NoTwoBeatsAreNearerThanVentriclesContract) {
  for (const double apart_s : {0.16, 0.20}) {
    Leads leads;
    leads.signals[1] = EcgSignal::kLeadOff;
    leads.tells(0, 14.0);
    leads.tells(0, 14.0 + apart_s);
    leads.run(15.0);
    EXPECT_EQ(leads.told.size(), apart_s < 0.18 ? 1U : 2U) << apart_s;
  }
}

// When each kind of beat is told that one lead tells alone, in ms after that lead has told it.
TEST(LeadAgreement, WaitsForTheOtherLeadTheLongerTheLessIsKnown) {
  const auto waited_ms = [](double confidence, Pondered other) {
    Leads leads;
    leads.pondered[1] = other;
    leads.tells(0, 14.0, confidence);
    const double known_s = leads.now_s;
    const auto beat = leads.told_at(14.0);
    return beat ? 1e3 * (seconds(beat->peak.detected_at) - known_s) : -1.0;
  };
  EXPECT_NEAR(waited_ms(0.93, Pondered::kBeat), 12.0, 2.0) << "sure, and the other makes up its mind";
  EXPECT_NEAR(waited_ms(0.93, Pondered::kNothing), 60.0, 4.1) << "sure, and the other has seen nothing";
  EXPECT_NEAR(waited_ms(0.85, Pondered::kBeat), 100.0, 4.1) << "not sure";
  EXPECT_NEAR(waited_ms(0.85, Pondered::kNothing), 100.0, 4.1);
}

TEST(LeadAgreement, IsToldAtOnceWhereTheOtherLeadIsOffAndAsSureAsByItself) {
  for (const int lead : {0, 1}) {
    Leads leads;
    leads.beats(10);
    leads.signals[static_cast<std::size_t>(1 - lead)] = EcgSignal::kFlat;
    leads.run(leads.now_s + 1.0);
    const double at_s = leads.now_s;
    leads.tells(lead, at_s, 0.7);
    const double known_s = leads.now_s;
    const auto beat = leads.told_at(at_s);
    ASSERT_TRUE(beat);
    EXPECT_EQ(beat->peak.confidence, 0.7);
    EXPECT_NEAR(seconds(beat->peak.detected_at), known_s, 0.003);
  }
}

// An arc of electrosurgery may look like a beat in one lead; the other has it too, and has never seen the like.
TEST(LeadAgreement, WhatIsStrangeToTheOtherLeadIsDoubtful) {
  Leads leads;
  leads.beats(20);
  leads.pondered[1] = Pondered::kStranger;
  EXPECT_EQ(leads.alone(0, 0.99), 0.5);
  EXPECT_EQ(leads.alone(0, 0.3), 0.3);
  leads.pondered[1] = Pondered::kBeat;
  EXPECT_EQ(leads.alone(0, 0.99), 0.99);
}

TEST(LeadAgreement, WhatIsStrangeToALeadThatIsHeardWorseIsNot) {
  for (const double worth : {0.65, 0.85}) {
    Leads leads(40.0);
    leads.beats(250, {0.99, 0.99 * worth});
    leads.pondered[1] = Pondered::kStranger;
    EXPECT_EQ(leads.alone(0, 0.99), worth < 0.75 ? 0.99 : 0.5) << worth;
  }
}

TEST(LeadAgreement, InNoiseThatBothHaveOneLeadAloneIsDoubtfulAndTheLesserPassedOver) {
  Leads leads;
  leads.beats(20);
  leads.signals = {EcgSignal::kNoisy, EcgSignal::kNoisy};
  leads.run(leads.now_s + 0.5);
  leads.last_s = leads.now_s;
  EXPECT_EQ(leads.agreement.leading(), 0);
  const double at_s = leads.last_s + kCycle_s;
  leads.tells(0, at_s);
  const double known_s = leads.now_s;
  const auto beat = leads.told_at(at_s);
  ASSERT_TRUE(beat);
  EXPECT_EQ(beat->peak.confidence, 0.5);
  EXPECT_NEAR(seconds(beat->peak.detected_at) - known_s, 0.06, 0.005) << "the other may tell it too";
  EXPECT_EQ(leads.alone(1, 0.99), 0.0);
  leads.last_s += kCycle_s;
  leads.tells(0, leads.last_s);
  leads.tells(1, leads.last_s);
  const auto both = leads.told_at(leads.last_s);
  ASSERT_TRUE(both);
  EXPECT_EQ(both->peak.confidence, 0.99) << "what both tell is told as the leading one tells it";
}

TEST(LeadAgreement, ALeadThatIsHeardWellIsBelievedBesideADisturbedOne) {
  for (const int lead : {0, 1}) {
    Leads leads;
    leads.beats(20);
    leads.signals[static_cast<std::size_t>(1 - lead)] = EcgSignal::kNoisy;
    leads.run(leads.now_s + 0.5);
    EXPECT_EQ(leads.alone(lead, 0.97), 0.97);
  }
}

TEST(LeadAgreement, ALeadIsHeardWellOnceItHasBeenGoodForASecond) {
  Leads leads;
  leads.signals[0] = EcgSignal::kNoisy;
  leads.run(20.0);
  leads.signals[0] = EcgSignal::kGood;
  leads.run(20.9);
  EXPECT_FALSE(leads.agreement.good(0));
  leads.run(21.1);
  EXPECT_TRUE(leads.agreement.good(0));
}

// Before that many beats are known the other is taken to miss one of ten.
TEST(LeadAgreement, WhatTheOtherLeadDoesNotSeeIsBelievedByHowOftenItMisses) {
  Leads fresh;
  EXPECT_NEAR(fresh.alone(0, 0.9), 0.474, 0.01);  // odds 9 x 0.1
  Leads fine;
  fine.beats(200);
  EXPECT_NEAR(fine.alone(0, 0.99), 0.497, 0.01) << "it misses one of a hundred at the least";  // odds 99 x 0.01
  Leads poor;
  poor.beats(200, {0.99, std::nullopt});
  EXPECT_NEAR(poor.alone(0, 0.9), 0.818, 0.01) << "and half of them at most";  // odds 9 x 0.5
  Leads sure;
  sure.beats(200);
  EXPECT_NEAR(sure.alone(0, 1.0), 0.666, 0.01) << "no lead rules the other out";  // odds 199 x 0.01
}

TEST(LeadAgreement, RemembersWhatIsMissedForThirtyTwoBeats) {
  Leads leads;
  leads.beats(200, {1.0, 1.0});
  leads.beats(10, {1.0, std::nullopt});  // the last four may still be told by it
  // Six of them, which are beats with a probability of 0.666 and more.
  EXPECT_NEAR(leads.alone(0, 0.9), 0.56, 0.02);
}

TEST(LeadAgreement, ADisturbedLeadMissesNothing) {
  Leads leads;
  leads.beats(200);
  leads.signals[1] = EcgSignal::kNoisy;
  leads.beats(20, {0.99, std::nullopt});
  leads.signals[1] = EcgSignal::kGood;
  leads.run(leads.now_s + 1.5);
  leads.last_s = leads.now_s;
  EXPECT_NEAR(leads.alone(0, 0.99), 0.497, 0.01);
}

// Else a lead that has begun to miss beats would never be found to.
TEST(LeadAgreement, WhatIsUnlikelyTeachesByAsMuchAsItIsLikely) {
  Leads leads;
  leads.beats(200);
  double last = 0.0;
  for (int i = 0; i < 60; ++i) last = leads.alone(0, 0.99);
  EXPECT_GT(last, 0.95);
  Leads unlikely;
  unlikely.beats(200);
  for (int i = 0; i < 60; ++i) last = unlikely.alone(0, 0.5);
  EXPECT_LT(last, 0.05);
}

TEST(LeadAgreement, WhatTheLesserLeadAloneTellsMustBeMoreLikelyThanNot) {
  Leads leads;
  EXPECT_EQ(leads.agreement.leading(), 0);
  EXPECT_EQ(leads.alone(1, 0.89), 0.0);            // odds 8.1 x 0.1
  EXPECT_NEAR(leads.alone(1, 0.935), 0.59, 0.01);  // odds 14.4 x 0.1
  EXPECT_NEAR(leads.alone(0, 0.89), 0.447, 0.01) << "the leading one's is told whatever it is";
}

TEST(LeadAgreement, WhatALeadOfLittleWorthTellsAloneIsPassedOver) {
  for (const double worth : {0.65, 0.85}) {
    Leads leads(40.0);
    leads.beats(250, {0.99, 0.99 * worth});
    const double told = leads.alone(1, 1.0);
    EXPECT_EQ(told > 0.0, worth > 0.75) << worth;
  }
}

// The T wave of the other.
TEST(LeadAgreement, WhatTheLesserLeadAloneTellsEarlyInTheCycleIsPassedOver) {
  for (const double cycles : {0.5, 0.7}) {
    Leads leads;
    leads.beats(60);
    EXPECT_EQ(leads.alone(1, 1.0, cycles) > 0.0, cycles > 0.6) << cycles;
    Leads leading;
    leading.beats(60);
    const double told = leading.alone(0, 1.0, cycles);
    EXPECT_GT(told, 0.0);
    EXPECT_EQ(told > 0.5, cycles > 0.6) << "and what the leading one tells is doubtful";
  }
}

TEST(LeadAgreement, ALeadWhoseEarlyBeatsTheOtherDoesNotKnowIsWorthLessAndTheOtherHasMissedNone) {
  Leads leads(40.0);
  leads.beats(200);
  EXPECT_EQ(leads.agreement.leading(), 0);
  for (int i = 0; i < 20; ++i) {
    leads.beats(1);
    const double beat_s = leads.last_s;
    leads.tells(0, beat_s + 0.3, 1.0);
    leads.run(beat_s + 0.5);
    leads.last_s = beat_s;
  }
  EXPECT_EQ(leads.agreement.leading(), 1);
  EXPECT_NEAR(leads.alone(0, 1.0), 0.666, 0.01) << "the other has missed none";
}

TEST(LeadAgreement, AGapBeforeTheSecondCommonBeatIsNoCycle) {
  Leads leads;
  leads.both(leads.last_s, 0.0);
  for (int i = 0; i < 12; ++i) leads.both(leads.last_s + (i == 0 ? 20.0 : 0.8), 0.0);
  const double at_s = leads.last_s + 0.7;
  leads.tells(1, at_s, 1.0);
  EXPECT_TRUE(leads.told_at(at_s)) << "a beat of a cycle of 0.8 s is not early";
}

TEST(LeadAgreement, TheCycleFollowsTheHeartWithinSomeBeatsAndNoPause) {
  const auto early = [](Leads& leads, double after_s) {
    const double at_s = leads.last_s + after_s;
    leads.tells(1, at_s, 1.0);
    return !leads.told_at(at_s);
  };
  const auto beats = [](Leads& leads, int count, double apart_s) {
    for (int i = 0; i < count; ++i) leads.both(leads.last_s + apart_s, 0.0);
  };
  // A beat counts when four more have been told. From 0.8 to 1.2 s: after eight 1.2 - 0.4 x (1 - 1/8)^8 = 1.06 s.
  Leads slower;
  beats(slower, 60, 0.8);
  beats(slower, 12, 1.2);
  EXPECT_TRUE(early(slower, 0.625));
  Leads not_yet;
  beats(not_yet, 60, 0.8);
  beats(not_yet, 12, 1.2);
  EXPECT_FALSE(early(not_yet, 0.665));
  // A pause of ten seconds counts as two cycles: 0.9 s.
  Leads pause;
  beats(pause, 60, 0.8);
  beats(pause, 1, 10.0);
  beats(pause, 4, 0.8);
  EXPECT_FALSE(early(pause, 0.58));
}

TEST(LeadAgreement, TheLeadThatIsHeardBetterLeadsASecondAndAHalfAfterTheOtherIsDisturbed) {
  Leads leads(60.0);
  leads.signals[0] = EcgSignal::kNoisy;
  leads.run(leads.now_s + 1.3);
  EXPECT_EQ(leads.agreement.leading(), 0);
  leads.run(leads.now_s + 0.7);
  EXPECT_EQ(leads.agreement.leading(), 1);
  Leads off(60.0);
  off.signals[0] = EcgSignal::kLeadOff;
  off.run(off.now_s + 0.01);
  EXPECT_EQ(off.agreement.leading(), 1) << "at once where it is off";
}

TEST(LeadAgreement, ALeadThatIsLittleBetterDoesNotTakeOver) {
  for (const double other : {0.90, 0.80}) {
    Leads leads(40.0);
    leads.beats(250, {other, 0.99});
    EXPECT_EQ(leads.agreement.leading(), other > 0.86 ? 0 : 1) << other;
  }
}

TEST(LeadAgreement, ADisturbedLeadIsWorthThreeTenths) {
  for (const double other : {0.28, 0.40}) {
    Leads leads(40.0);
    leads.beats(250, {0.99, other});
    leads.signals[0] = EcgSignal::kNoisy;
    leads.run(leads.now_s + 60.0);
    EXPECT_EQ(leads.agreement.leading(), other < 0.34 ? 0 : 1) << other;
  }
}

// The second lead's R wave peaks later, which is learnt; a beat that one lead tells has the first one's time.
TEST(LeadAgreement, TimesAreThoseOfTheFirstLead) {
  const auto later_s = [](Leads& leads) {
    leads.signals[0] = EcgSignal::kLeadOff;
    leads.run(leads.now_s + 1.0);
    const double at_s = leads.now_s;
    leads.tells(1, at_s);
    leads.run(at_s + 0.5);
    return at_s - seconds(leads.told.back().peak.time);
  };
  const auto learns = [](Leads& leads, int count, double second_later_s) {
    for (int i = 0; i < count; ++i) leads.both(leads.last_s + kCycle_s, second_later_s);
  };
  Leads even;
  learns(even, 40, 0.015);
  EXPECT_NEAR(later_s(even), 0.015, 1e-4);
  // Beats of another origin differ, and hardly count once it is known.
  Leads odd;
  learns(odd, 40, 0.0);
  learns(odd, 5, 0.11);
  EXPECT_NEAR(later_s(odd), 0.010, 0.001);
  Leads eighth;
  learns(eighth, 7, 0.0);
  learns(eighth, 1, 0.08);
  EXPECT_NEAR(later_s(eighth), 0.010, 0.001) << "the mean of the first eight";
  Leads tenth;
  learns(tenth, 9, 0.0);
  learns(tenth, 1, 0.08);
  EXPECT_NEAR(later_s(tenth), 0.002, 1e-4);
}

// What a lead is long in doubt about has been told by the other: it is no second beat, and none that it missed.
TEST(LeadAgreement, ABeatThatALeadTellsLateIsTheOneThatWasTold) {
  Leads leads;
  leads.beats(200);
  const std::size_t before = leads.told.size();
  for (int i = 0; i < 20; ++i) {
    const double at_s = leads.last_s + kCycle_s;
    leads.pondered[1] = Pondered::kBeat;
    leads.tells(0, at_s);
    leads.run(at_s + 0.35);
    leads.pondered[1] = Pondered::kNothing;
    leads.take(1, at_s, 0.5);
  }
  EXPECT_EQ(leads.told.size(), before + 20);
  EXPECT_NEAR(leads.alone(0, 0.99), 0.497, 0.01) << "it has missed none";
}

TEST(LeadAgreement, AtTheEndWhatWaitsIsTold) {
  Leads leads;
  leads.tells(0, 14.0);
  EXPECT_TRUE(leads.told.empty());
  const auto beat = leads.agreement.decide(true, [](int, Instant, Duration) { return Pondered::kNothing; });
  EXPECT_TRUE(beat);
}

}  // namespace
}  // namespace perimap::test
