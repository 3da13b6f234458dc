// What is told of complexes as they are measured, and when: each test says what one setting of the decision is for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <vector>

#include "decision_patient.hpp"

namespace perimap::test {
namespace {

// ---- when a beat is told

TEST(BeatDecision, ABeatOfAKnownKindIsToldAtOnce) {
  Known patient;
  patient.see(patient.last_s + 0.8);
  EXPECT_LT(patient.delay_s(patient.last_s), 0.12);
  EXPECT_GT(patient.confidence(patient.last_s), 0.99);
}

TEST(BeatDecision, RhythmAloneMakesNoBeatAtOnce) {
  double least_at_once = 10.0;
  double most_later = -10.0;
  for (double weakness = 0.4; weakness > 0.15; weakness *= 0.99) {
    Known patient;
    const double beat_s = patient.last_s + 0.8;
    const Change change = [&](QrsCandidate& c) { c.sharpness *= weakness, c.energy *= std::sqrt(weakness); };
    const double alone = by_itself(patient, patient.complex(beat_s, change));
    patient.see(beat_s, change);
    ASSERT_GT(patient.confidence(beat_s), 0.99);
    if (patient.delay_s(beat_s) < 0.12) {
      least_at_once = std::min(least_at_once, alone);
    } else {
      most_later = std::max(most_later, alone);
    }
  }
  EXPECT_NEAR(least_at_once, 0.7, 0.1);
  EXPECT_NEAR(most_later, 0.7, 0.1);
}

// Late beats that are hardly of the kind, ever weaker.
TEST(BeatDecision, WhatIsMoreLikelyNoneIsNotTold) {
  double least = 1.0;
  int waited = 0;
  int by_steps = 0;
  for (double weakness = 0.2; weakness > 0.05; weakness *= 0.97) {
    Known patient;
    const double beat_s = patient.last_s + 1.3 * 0.8;
    patient.see(beat_s, [&](QrsCandidate& c) {
      c.shape = like_beat(0.84);
      c.sharpness *= weakness;
      c.energy *= std::sqrt(weakness);
    });
    const auto peak = patient.told_at(beat_s);
    if (!peak) continue;
    least = std::min(least, peak->confidence);
    const double waited_s = patient.delay_s(beat_s) - 0.096;
    if (waited_s > 0.15) {
      EXPECT_NEAR(std::remainder(waited_s, 0.020), 0.0, 1e-3) << "it becomes likely as nothing else comes";
      ++waited;
      by_steps += std::abs(std::remainder(waited_s, 0.040)) > 0.01 ? 1 : 0;
    }
    if (peak->confidence > 0.6) {
      EXPECT_NEAR(patient.delay_s(beat_s), 0.180, 0.01) << "of a kind that is no P wave";
    }
  }
  EXPECT_GE(least, 0.5);
  EXPECT_LT(least, 0.55);
  EXPECT_GE(waited, 3);
  EXPECT_GE(by_steps, 1);
}

// Ever weaker ones that are like nothing: where they cease to be sure, and to be told. Between the two the odds fall
// from nine to one, of which nine tenths of the complex's own count.
TEST(BeatDecision, WhatIsLikeNothingAndNotSureWaitsForAQrsComplexThatMayFollow) {
  double last_sure = 0.0;
  double last_told = 0.0;
  for (double weakness = 1.0; weakness > 0.02; weakness *= 0.96) {
    Known patient;
    const double beat_s = patient.last_s + 0.8;
    const Change change = [&](QrsCandidate& c) { c.shape = kWide, c.sharpness *= weakness; };
    patient.see(beat_s, change);
    const double delay_s = patient.delay_s(beat_s);
    if (delay_s < 0.0) continue;
    const double alone = by_itself(patient, patient.complex(beat_s, change));
    last_told = alone;
    if (delay_s < 0.3) {
      EXPECT_NEAR(delay_s, 0.225, 0.035);
      last_sure = alone;
    } else if (delay_s < 0.40) {
      EXPECT_NEAR(delay_s, 0.345, 0.012);
    }
  }
  EXPECT_NEAR(0.9 * (last_sure - last_told), std::log(9.0), 0.6);
}

TEST(BeatDecision, WhatIsStillUndecidedAfterNearlyASecondIsNone) {
  Known patient(40, 1.5);
  const double at_s = patient.last_s + 0.25;
  patient.see(at_s, [](QrsCandidate& c) {
    c.shape = strange_shape(7);
    c.rough = 8.0 * c.energy;
  });
  patient.run(at_s + 0.85);
  EXPECT_FALSE(patient.decision.noisy(at(patient.now_s)));
  patient.run(at_s + 1.05);
  EXPECT_TRUE(patient.decision.noisy(at(patient.now_s))) << "but a disturbance";
}

TEST(BeatDecision, AtTheStartTheFirstThreeWaitForWhatMayFollowThem) {
  Patient patient;
  std::vector<double> at_s;
  for (int i = 0; i < 5; ++i) {
    patient.strangers(1, 0.8);
    at_s.push_back(patient.last_s);
  }
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(patient.delay_s(at_s[static_cast<std::size_t>(i)]), 0.700, 0.02) << i;
  EXPECT_LT(patient.delay_s(at_s[3]), 0.6);
}

TEST(BeatDecision, WhatIsLikeNothingWaitsForTheBeatItselfUnlessItComesEarly) {
  const auto delay_s = [](double cycles) {
    Known patient;
    const double beat_s = patient.last_s + cycles * 0.8;
    patient.see(beat_s, shaped(kWide));
    return patient.delay_s(beat_s);
  };
  EXPECT_NEAR(delay_s(1.0), 0.195, 0.01);
  EXPECT_NEAR(delay_s(0.90), 0.195, 0.01);
  EXPECT_NEAR(delay_s(0.80), 0.180, 0.02) << "no beat is still to come";
}

// A sharper one follows some beats, as a QRS complex follows a P wave.
TEST(BeatDecision, AKindThatMayBeAPWaveWaitsForItsQrsComplex) {
  const auto longest_s = [](int one_in) {
    Patient patient;
    for (int i = 0; i < 60; ++i) {
      patient.beats(1, i % one_in == 1 ? 0.64 : 0.8);
      if (i % one_in != 0) continue;
      patient.see(patient.last_s + 0.16, [](QrsCandidate& c) { c.shape = kWide, c.sharpness *= 1.6; });
    }
    double longest = 0.0;
    for (const RPeak& peak : patient.told) {
      if (seconds(peak.time) < 30.0 || match(peak.shape, kBeat).correlation < 0.95) continue;
      longest = std::max(longest, to_seconds(peak.detected_at - peak.time));
    }
    return longest;
  };
  EXPECT_NEAR(longest_s(3), 0.350, 0.01);
  EXPECT_LT(longest_s(4), 0.12) << "so many are followed by chance";
}

// The longest PR interval that is usual: the QRS complex is measured just before its P wave would be told.
TEST(BeatDecision, APWaveOfTheBeatsShapeWaitsForAQrsComplexThatComesLate) {
  Patient patient;
  int p_waves = 0;
  for (int i = 0; i < 12; ++i) {
    patient.see(patient.last_s + 1.5,
                [](QrsCandidate& c) { c.shape = like_beat(0.96, 0.6), c.energy *= 0.66, c.sharpness *= 0.41; });
    const double p_s = patient.last_s;
    patient.see(p_s + 0.252);
    if (i > 3) p_waves += patient.told_at(p_s).has_value() ? 1 : 0;
  }
  EXPECT_EQ(p_waves, 0);
}

// A P wave that is like nothing is told with doubt before its own QRS complex is measured.
TEST(BeatDecision, WhatWasToldWithDoubtHidesNoBeatOfAKnownKind) {
  Known patient;
  const double p_s = patient.last_s + 0.6;
  patient.see(p_s, [](QrsCandidate& c) { c.shape = strange_shape(7), c.energy *= 0.5, c.sharpness *= 0.3; });
  patient.see(p_s + 0.27);
  EXPECT_NEAR(patient.confidence(p_s), 0.5, 0.01);
  EXPECT_GT(patient.confidence(p_s + 0.27), 0.9);
}

// It has two maxima, the second of which looks more like the beats.
TEST(BeatDecision, TheEndOfAComplexThatWasToldWithDoubtIsNoBeat) {
  for (const double apart_s : {0.075, 0.1}) {
    Known patient;
    const double first_s = patient.last_s + 0.7;
    patient.see(first_s, [](QrsCandidate& c) { c.shape = strange_shape(7), c.energy *= 0.7; });
    patient.see(first_s + apart_s, [](QrsCandidate& c) { c.energy *= 0.8, c.sharpness *= 0.8; });
    EXPECT_NE(patient.told_at(first_s).has_value(), patient.told_at(first_s + apart_s).has_value()) << apart_s;
  }
}

// Every second P wave is conducted, after 0.16 s.
TEST(BeatDecision, APWaveWithoutAQrsComplexIsNoBeatOnceTwoHaveBeenConducted) {
  Patient patient;
  std::vector<double> blocked_s;
  std::vector<double> beats_s;
  double p_s = 0.2;
  for (int i = 0; i < 24; ++i, p_s += 0.8) {
    patient.see(p_s, [](QrsCandidate& c) { c.shape = kWide, c.energy *= 0.7, c.sharpness *= 0.5; });
    if (i % 2 == 0) {
      blocked_s.push_back(p_s);
      continue;
    }
    patient.see(p_s + 0.16);
    beats_s.push_back(p_s + 0.16);
  }
  for (std::size_t i = 2; i + 1 < blocked_s.size(); ++i) EXPECT_FALSE(patient.told_at(blocked_s[i])) << i;
  for (std::size_t i = 1; i < beats_s.size(); ++i) EXPECT_TRUE(patient.told_at(beats_s[i])) << i;
}

// ---- two of one complex, and two beats

TEST(BeatDecision, OfTwoMeasuresOfOneComplexTheFarLargerIsItsMiddle) {
  const auto told_s = [](double times, double apart_s) {
    Known patient;
    const double beat_s = patient.last_s + 0.8;
    patient.run(beat_s + Patient::kMeasured_s);
    for (const double at_s : {beat_s, beat_s + apart_s}) {
      const double by = at_s == beat_s ? 0.6 : 0.6 * times;
      patient.decision.consider(patient.complex(at_s, weaker(by)), CandidateSettings{}.one_complex, at(patient.now_s));
    }
    patient.run(beat_s + 1.2);
    std::vector<double> all;
    for (const RPeak& peak : patient.told) {
      if (seconds(peak.time) > beat_s - 0.01) all.push_back(seconds(peak.time) - beat_s);
    }
    return all;
  };
  EXPECT_NEAR(told_s(1.1, 0.025).at(0), 0.0, 1e-6);
  EXPECT_NEAR(told_s(1.32, 0.025).at(0), 0.025, 1e-6);
}

// It would be a disturbance, so large, were it not of the beat.
TEST(BeatDecision, WhatIsSoNearABeatIsOfIt) {
  const auto noisy = [](double after_s) {
    Known patient;
    patient.beats(1);
    patient.run(patient.last_s + 0.2);
    patient.decision.consider(
        patient.complex(patient.last_s + after_s, [](QrsCandidate& c) { c.energy *= 5.0, c.shape = kWide; }),
        CandidateSettings{}.one_complex, at(patient.now_s));
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_FALSE(noisy(0.052));
  EXPECT_TRUE(noisy(0.068));
}

TEST(BeatDecision, VentriclesDoNotContractTwiceWithinTheirRefractoryTime) {
  const auto told = [](double apart_s) {
    Known patient(40, 0.30);
    const double beat_s = patient.last_s + 0.30;
    patient.see(beat_s);
    patient.see(beat_s + apart_s, [](QrsCandidate& c) { c.energy *= 1.3; });
    patient.see(beat_s + apart_s + 0.3);
    return patient.told_at(beat_s + apart_s).has_value();
  };
  EXPECT_FALSE(told(0.165));
  EXPECT_TRUE(told(0.195));
}

// ---- the ends of the line

// Half of its shape is made up.
TEST(BeatDecision, ABeatThatTheEndCutsOffIsToldWhenItIsCertain) {
  const auto told = [](double cycles, double seen_s, const Change& change) {
    Known patient;
    const double beat_s = patient.last_s + cycles * 0.8;
    patient.run(beat_s + 0.03);
    patient.decision.consider(patient.complex(beat_s, change), CandidateSettings{}.one_complex, at(patient.now_s));
    patient.decision.decide(at(beat_s + seen_s), true);
    bool found = false;
    while (const auto peak = patient.decision.pop()) found = found || std::abs(seconds(peak->time) - beat_s) < 0.01;
    return found;
  };
  const Change likely = [](QrsCandidate& c) {
    c.shape = like_beat(0.84);
    c.sharpness *= 0.13;
    c.energy *= std::sqrt(0.13);
  };
  EXPECT_TRUE(told(1.0, 0.040, weaker(0.5)));
  EXPECT_FALSE(told(1.3, 0.040, likely));
  EXPECT_TRUE(told(1.3, 0.057, likely));
}

TEST(BeatDecision, WhenTheLineBeginsTheLastBeatMayHaveBeenJustBefore) {
  for (const double weakness : {0.26, 0.24, 0.22, 0.20}) {
    Patient patient;
    patient.run(4.0);
    const Change change = [&](QrsCandidate& c) { c.sharpness *= weakness, c.energy *= std::sqrt(weakness); };
    patient.see(4.5, change);
    const double odds = std::exp(0.9 * by_itself(patient, patient.complex(4.5, change)));
    const double since = odds * RhythmModel{}.survival(0.7 - 0.1);
    const double expected = since / (since + 0.3);
    const double told = patient.confidence(4.5);
    if (expected > 0.52) {
      EXPECT_NEAR(told, expected, 0.03) << weakness;
    }
  }
}

// On a line of noise alone.
TEST(BeatDecision, AtTheStartABeatStandsOutOrIsExactlyLikeAnotherAsNoiseHardlyIs) {
  const auto told = [](double log_to_quiet, double correlation) {
    Patient patient(0.1, 0.0);
    const double energy = std::exp(log_to_quiet) * patient.levels.quiet();
    for (const QrsShape& shape : {kBeat, like_beat(correlation)}) {
      patient.see(patient.last_s + 0.8, [&](QrsCandidate& c) { c.shape = shape, c.energy = energy; });
    }
    patient.run(patient.last_s + 1.2);
    return patient.told.size();
  };
  EXPECT_EQ(told(1.10, 0.94), 0U);
  EXPECT_EQ(told(1.40, 0.94), 2U);
  EXPECT_EQ(told(1.10, 1.00), 1U);
}

// As a P wave that is not conducted: nothing else comes when the second beat is due.
TEST(BeatDecision, AtTheStartWhatIsNoBeatByItselfIsNoneBecauseOneIsDue) {
  const auto told = [](double sharp) {
    Patient patient;
    patient.beats(1);
    const double p_s = patient.last_s + 0.55;
    patient.see(p_s, [=](QrsCandidate& c) { c.shape = kWide, c.energy *= 0.33, c.sharpness *= sharp; });
    return patient.told_at(p_s).has_value();
  };
  EXPECT_TRUE(told(0.30));
  EXPECT_FALSE(told(0.165));
}

TEST(BeatDecision, WhereTheLineBeginsOnlyWhatIsVeryLikeTheBeatsIsOne) {
  const auto told = [](double after_s, double correlation) {
    Known patient;
    patient.run(patient.last_s + 0.5);
    const double begin_s = patient.now_s;
    patient.decision.restart(at(begin_s));
    patient.see(begin_s + after_s, shaped(like_beat(correlation)));
    return patient.told_at(begin_s + after_s).has_value();
  };
  EXPECT_TRUE(told(0.2, 1.0));
  EXPECT_TRUE(told(0.2, 0.95));
  EXPECT_FALSE(told(0.2, 0.88));
  EXPECT_FALSE(told(0.36, 0.88));
  EXPECT_TRUE(told(0.45, 0.88));
}

// ---- what recurs

TEST(BeatDecision, OnlyWhatStandsOutIsLearntAsWhatRecurs) {
  const auto learnt = [](const Patient& patient) { return patient.decision.clusters().nearest(kWide, 0).of >= 0; };
  const auto seen = [&](double of_quiet, double of_top, double noise_mV) {
    Known patient(10, 0.8, noise_mV);
    const double energy = std::max(of_quiet * patient.levels.quiet(), of_top * patient.levels.top_energy());
    patient.see(patient.last_s + 0.4, [&](QrsCandidate& c) { c.shape = kWide, c.energy = energy; });
    return learnt(patient);
  };
  EXPECT_FALSE(seen(2.2, 0.0, 0.4));
  EXPECT_TRUE(seen(2.8, 0.0, 0.4));
  EXPECT_FALSE(seen(0.0, 0.085, 0.0));
  EXPECT_TRUE(seen(0.0, 0.115, 0.0));
}

// The share of the wide ones that a sharper complex follows.
double followed(double pr_s, double sharper, bool one_kind = false) {
  Patient patient;
  for (int i = 0; i < 20; ++i) {
    patient.see(patient.last_s + 0.8 - pr_s,
                [&](QrsCandidate& c) { c.shape = one_kind ? kBeat : kWide, c.sharpness /= sharper; });
    patient.see(patient.last_s + pr_s);
  }
  const QrsClusters& clusters = patient.decision.clusters();
  return clusters.followers(clusters.nearest(one_kind ? kBeat : kWide, 0).of);
}

TEST(BeatDecision, AQrsComplexFollowsAPWaveByAPrInterval) {
  EXPECT_LT(followed(0.085, 1.5), 0.3);
  EXPECT_GT(followed(0.125, 1.5), 0.7);
  EXPECT_GT(followed(0.260, 1.5), 0.7);
  EXPECT_LT(followed(0.300, 1.5), 0.3);
}

// Ventricular beats after normal ones, a quarter of a second later, in a heart so fast.
TEST(BeatDecision, WhereBeatsComeInPairsTheSecondIsNoQrsComplexOfTheFirst) {
  const auto followers = [](double pause_s) {
    Patient patient;
    for (int i = 0; i < 40; ++i) {
      patient.see(patient.last_s + pause_s);
      patient.see(patient.last_s + 0.25, [](QrsCandidate& c) { c.shape = kWide, c.sharpness *= 1.2; });
    }
    patient.run(patient.last_s + 1.2);
    const QrsClusters& clusters = patient.decision.clusters();
    return clusters.followers(clusters.nearest(kBeat, 0).of);
  };
  EXPECT_LT(followers(0.55), 0.3) << "the mean cycle is 0.4 s";
}

TEST(BeatDecision, AQrsComplexIsAsSharpAsItsPWaveAndSharperWhereBothHaveOneShape) {
  EXPECT_LT(followed(0.16, 0.85), 0.3);
  EXPECT_GT(followed(0.16, 1.15), 0.7);
  EXPECT_LT(followed(0.16, 1.08, true), 0.3);
  EXPECT_GT(followed(0.16, 1.30, true), 0.3);
}

// What the wide ones are judged to be, by themselves, when they come so long after a beat that is sharper.
double judged(double after_s, double sharpness = 0.5) {
  Patient patient;
  for (int i = 0; i < 40; ++i) {
    patient.see(patient.last_s + 0.8 - (i > 0 ? after_s : 0.0));
    patient.see(patient.last_s + after_s, [&](QrsCandidate& c) { c.shape = kWide, c.sharpness *= sharpness; });
  }
  const QrsClusters& clusters = patient.decision.clusters();
  return clusters.log_odds(clusters.nearest(kWide, 0).of);
}

TEST(BeatDecision, ATWaveComesSomeTimeAfterASharperComplex) {
  const double alone = judged(0.46);
  EXPECT_NEAR(judged(0.108), alone, 0.2);
  EXPECT_LT(judged(0.135), alone - 0.4);
  EXPECT_LT(judged(0.400), alone - 0.4);
  EXPECT_NEAR(judged(0.440), alone, 0.2);
}

TEST(BeatDecision, NoComplexIsJudgedBeyondAllDoubt) { EXPECT_NEAR(judged(0.3, 0.001), -6.0 * 12.0 / 14.0, 0.2); }

// ---- what the last beats were like

TEST(BeatLevels, BeatsPointTheWayThatPrevailsOverTheLastEight) {
  const DecisionSettings settings;
  BeatLevels levels;
  QrsCandidate beat;
  const auto see = [&](double upward, double downward, int count) {
    beat.upward = upward;
    beat.downward = downward;
    for (int i = 0; i < count; ++i) levels.turn(beat, settings);
    return levels.polarity().up;
  };
  EXPECT_TRUE(see(1.0, 0.5, 30));
  EXPECT_TRUE(see(1.0, 1.2, 60)) << "of nearly equal parts";
  EXPECT_FALSE(see(1.0, 1.45, 60));
  EXPECT_FALSE(see(1.2, 1.0, 60));
  EXPECT_TRUE(see(1.45, 1.0, 60));
  see(1.0, 0.5, 60);
  EXPECT_TRUE(see(0.5, 1.0, 7));
  EXPECT_FALSE(see(0.5, 1.0, 4));
}

// ---- silence

TEST(BeatDecision, BeatsAreLookedForAnewAfterThreeSecondsAndThreeCycles) {
  const auto learning = [](double cycle_s, double after_s) {
    Known patient(40, cycle_s);
    patient.run(patient.last_s + 0.3);
    return patient.decision.learning(at(patient.last_s + after_s));
  };
  EXPECT_FALSE(learning(0.8, 2.8));
  EXPECT_TRUE(learning(0.8, 3.3));
  EXPECT_FALSE(learning(1.5, 4.2));
  EXPECT_TRUE(learning(1.5, 4.8));
  EXPECT_FALSE(learning(2.7, 6.3));
  EXPECT_TRUE(learning(2.7, 6.9)) << "a block must not make it wait for ever";
}

}  // namespace
}  // namespace perimap::test
