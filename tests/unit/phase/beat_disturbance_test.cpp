// What the decision on beats takes for disturbances, and how sure it is beside them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <vector>

#include "decision_patient.hpp"

namespace perimap::test {
namespace {

// ---- disturbances

TEST(BeatDecision, WhatIsOfABeatsSizeAndLikeNothingIsADisturbance) {
  const auto noisy = [](double size) {
    Known patient;
    patient.see(patient.last_s + 0.35, [&](QrsCandidate& c) {
      c.shape = strange_shape(7);
      c.energy *= size;
      c.sharpness *= size;
      c.step = 3.0;
    });
    patient.see(patient.last_s + 0.45);
    patient.run(patient.last_s + 0.3);
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_FALSE(noisy(0.28));
  EXPECT_TRUE(noisy(0.40));
}

TEST(BeatDecision, WhatIsFarLargerThanBeatsIsOneAtOnce) {
  const auto noisy = [](double energy, double correlation) {
    Known patient;
    patient.see(patient.last_s + 0.8, [&](QrsCandidate& c) { c.shape = like_beat(correlation), c.energy *= energy; });
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_FALSE(noisy(3.5, 0.8));
  EXPECT_TRUE(noisy(4.6, 0.8));
  EXPECT_TRUE(noisy(4.6, 0.86));
  EXPECT_FALSE(noisy(4.6, 0.95)) << "the gain has risen";
}

TEST(BeatDecision, ADisturbanceIsRememberedForTwoSeconds) {
  Disturbed with_beats(1, 0.3);
  with_beats.last_s = with_beats.familiar_s;
  with_beats.beats(4);
  EXPECT_FALSE(with_beats.decision.noisy(at(with_beats.disturbed_s + 2.0)));
  EXPECT_TRUE(with_beats.decision.noisy(at(with_beats.disturbed_s + 1.62)));
}

TEST(BeatDecision, ManyDisturbancesAreForgottenHardlyLaterThanThree) {
  Disturbed many(12, 0.3);
  many.last_s = many.familiar_s + 0.8;
  many.beats(6);
  EXPECT_TRUE(many.decision.noisy(at(many.disturbed_s + 3.2)));
  EXPECT_FALSE(many.decision.noisy(at(many.disturbed_s + 3.65)));
}

TEST(BeatDecision, WhileBeatsComeItTakesMoreNoiseToMakeABurst) {
  const Disturbed two(2, 0.3);
  EXPECT_TRUE(two.decision.in_burst(at(two.disturbed_s + 0.3)));
  EXPECT_FALSE(two.decision.in_burst(at(two.disturbed_s + 0.58)));
  const Disturbed one(1, 1.2);
  EXPECT_FALSE(one.decision.in_burst(at(one.familiar_s + 1.35)));
  EXPECT_TRUE(one.decision.in_burst(at(one.familiar_s + 1.65)));
  const Disturbed late(1, 2.0);
  EXPECT_TRUE(late.decision.in_burst(at(late.disturbed_s + 0.85)));
  EXPECT_FALSE(late.decision.in_burst(at(late.disturbed_s + 1.25)));
}

TEST(BeatDecision, WhereNoBeatComesAmongManyDisturbancesTheLeadIsOff) {
  const Disturbed soon(12, 0.1);
  EXPECT_FALSE(soon.decision.chaotic(at(soon.familiar_s + 0.87)));
  EXPECT_TRUE(soon.decision.chaotic(at(soon.familiar_s + 1.05)));
  const Disturbed late(12, 0.8);
  EXPECT_TRUE(late.decision.chaotic(at(late.disturbed_s + 0.30)));
  EXPECT_FALSE(late.decision.chaotic(at(late.disturbed_s + 0.62)));
}

TEST(BeatDecision, ABeatIsOverdueWhenItsCycleIsOver) {
  const Known fast(40, 0.5);
  EXPECT_FALSE(fast.decision.overdue(at(fast.last_s - 0.5 + 0.80)));
  EXPECT_TRUE(fast.decision.overdue(at(fast.last_s - 0.5 + 1.0)));
  const Known slow(40, 1.5);
  EXPECT_FALSE(slow.decision.overdue(at(slow.last_s - 1.5 + 1.4)));
  EXPECT_TRUE(slow.decision.overdue(at(slow.last_s - 1.5 + 1.6)));
}

// Two that each look like a QRS complex, apart by less than a cycle and more than the maxima of a wide one.
TEST(BeatDecision, ComplexesThatCrowdAreADisturbance) {
  const auto noisy = [](double apart_s, double by = 1.0, double cycle_s = 0.8) {
    Known patient(40, cycle_s);
    const double first_s = patient.last_s + cycle_s;
    patient.see(first_s);
    patient.run(first_s + 0.12);
    patient.see(first_s + apart_s, weaker(by));
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_FALSE(noisy(0.095));
  EXPECT_TRUE(noisy(0.130));
  EXPECT_TRUE(noisy(0.225));
  EXPECT_FALSE(noisy(0.262));
  // In a fast heart premature beats come sooner: 0.4 of 0.45 s.
  EXPECT_TRUE(noisy(0.165, 1.0, 0.45));
  EXPECT_FALSE(noisy(0.195, 1.0, 0.45));
  double least = 10.0;
  for (double by = 1.0; by > 0.2; by *= 0.97) {
    const Known patient;
    // The one before is a sharper one within the T wave's time.
    if (noisy(0.15, by)) least = std::min(least, by_itself(patient, patient.complex(1.0, weaker(by))) + std::log(by));
  }
  EXPECT_NEAR(least, 0.7, 0.15);
}

TEST(BeatDecision, AWaveThatIsKnownIsNoDisturbanceThoughTheLineStepsBesideIt) {
  const auto noisy = [](const QrsShape& shape, double step_beside) {
    Patient patient;
    const auto wave_of = [&](const QrsShape& s, double step) {
      patient.see(patient.last_s + 0.3,
                  [&, step](QrsCandidate& c) { c.shape = s, c.energy *= 0.8, c.sharpness *= 0.2, c.step = step; });
    };
    for (int i = 0; i < 40; ++i) {
      patient.see(patient.last_s + 0.5);
      wave_of(kWide, 0.0);
    }
    patient.see(patient.last_s + 0.5);
    wave_of(shape, step_beside);
    patient.beats(1, 0.5);
    patient.run(patient.last_s + 0.3);
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_FALSE(noisy(kWide, 0.86));
  EXPECT_TRUE(noisy(strange_shape(7), 0.86));
  EXPECT_TRUE(noisy(kWide, 0.94)) << "but where the line does not come back at all";
}

// Each beat of every second pair is of a kind whose members all step: the second pair of minutes of such a rhythm.
TEST(BeatDecision, ABeatOfAKindThatRecursForLongerThanBurstsLastIsNoDisturbance) {
  const auto noisy_after = [](double minutes, double correlation) {
    Known patient;
    const double begin_s = patient.last_s;
    const auto stepping = [](const QrsShape& shape) {
      return [=](QrsCandidate& c) { c.shape = shape, c.step = 0.82; };
    };
    while (patient.last_s < begin_s + 60.0 * minutes) {
      patient.beats(1, 0.9);
      patient.see(patient.last_s + 0.5, stepping(kWide));
    }
    patient.beats(12);
    patient.see(patient.last_s + 0.8, stepping(between(kWide, strange_shape(3), correlation)));
    patient.run(patient.last_s + 0.6);
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_TRUE(noisy_after(0.2, 1.0));
  EXPECT_FALSE(noisy_after(1.0, 1.0));
  EXPECT_TRUE(noisy_after(1.0, 0.85)) << "but what is less like them";
}

TEST(BeatDecision, AStepIsADisturbanceAsSoonAsItIsSeen) {
  const auto noisy = [](double step) {
    Known patient;
    patient.see(patient.last_s + 0.4, [&](QrsCandidate& c) { c.shape = strange_shape(7), c.step = step; });
    patient.run(patient.last_s + 0.12);
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_FALSE(noisy(0.86));
  EXPECT_TRUE(noisy(0.94));
}

// Where one that is like nothing ceases to be told: others of its kind around it make it less likely.
TEST(BeatDecision, StrangersComeInCrowds) {
  const auto least_told = [](double apart_s) {
    double least = 10.0;
    for (double weakness = 1.0; weakness > 0.02; weakness *= 0.97) {
      Known patient;
      const double beat_s = patient.last_s + 0.8;
      const Change change = [&](QrsCandidate& c) { c.shape = kWide, c.sharpness *= weakness; };
      patient.see(beat_s - apart_s, [](QrsCandidate& c) {
        c.shape = strange_shape(7);
        c.energy *= 0.6;
        c.sharpness *= 0.6;
        c.rough = 50.0 * c.energy;
        c.step = 3.0;
      });
      patient.see(beat_s, change);
      patient.run(beat_s + 0.4);
      const bool told = std::any_of(patient.told.begin(), patient.told.end(),
                                    [&](const RPeak& p) { return std::abs(seconds(p.time) - beat_s) < 0.01; });
      if (told) least = std::min(least, by_itself(patient, patient.complex(beat_s, change)));
    }
    return least;
  };
  EXPECT_GT(least_told(0.46), least_told(0.54) + 0.2);
}

// ---- how sure a beat is told to be

TEST(BeatDecision, AnEarlyBeatIsDoubtful) {
  const auto confidence = [](double cycles, const QrsShape& shape) {
    Known patient;
    const double beat_s = patient.last_s + cycles * 0.8;
    patient.see(beat_s, shaped(shape));
    return patient.confidence(beat_s);
  };
  EXPECT_GT(confidence(0.75, like_beat(0.98)), 0.5);
  EXPECT_LE(confidence(0.75, like_beat(0.94)), 0.5) << "where it is less like the others";
  EXPECT_GT(confidence(0.75, like_beat(1.0, std::exp(0.22))), 0.5);
  EXPECT_LE(confidence(0.75, like_beat(1.0, std::exp(0.4))), 0.5) << "or of another size";
}

TEST(BeatDecision, WhatIsUnlikeTheBeatsIsDoubtful) {
  const auto confidence = [](const Change& change) {
    Known patient;
    const double beat_s = patient.last_s + 0.8;
    patient.see(beat_s, change);
    return patient.confidence(beat_s);
  };
  EXPECT_GT(confidence(shaped(like_beat(0.86))), 0.5);
  EXPECT_NEAR(confidence(shaped(like_beat(0.80))), 0.5, 1e-9);
  EXPECT_GT(confidence([](QrsCandidate& c) { c.step = 0.68; }), 0.5);
  EXPECT_NEAR(confidence([](QrsCandidate& c) { c.step = 0.82; }), 0.5, 1e-9);
  EXPECT_GT(confidence([](QrsCandidate& c) { c.rough = 0.45 * c.energy; }), 0.5);
  EXPECT_NEAR(confidence([](QrsCandidate& c) { c.rough = 0.55 * c.energy; }), 0.5, 1e-9);
}

// Every so many of the wide ones a beat follows, as a QRS complex follows its P wave.
TEST(BeatDecision, WhatOftenHasASharperOneAfterItIsDoubtful) {
  const auto most = [](int every) {
    Patient patient;
    for (int i = 0; i < 60; ++i) {
      patient.see(patient.last_s + 0.8, [](QrsCandidate& c) { c.shape = kWide, c.sharpness *= 0.9; });
      if (i % every == 0) patient.see(patient.last_s + 0.2, [](QrsCandidate& c) { c.energy *= 1.2; });
    }
    double confidence = 0.0;
    for (const RPeak& peak : patient.told) {
      if (seconds(peak.time) > 40.0 && match(peak.shape, kWide).correlation > 0.99) {
        confidence = std::max(confidence, peak.confidence);
      }
    }
    return confidence;
  };
  EXPECT_GT(most(8), 0.9);
  EXPECT_LE(most(2), 0.5);
}

// Of four beats so many have a second complex in their cycle that looks as much like a QRS.
double told_with_rivals(int of_four) {
  Patient patient;
  double at_s = 0.0;
  for (int i = 0; i < 60; ++i) {
    patient.see(at_s = 1.0 + 1.0 * i);
    if (i % 4 >= of_four) continue;
    patient.see(at_s + 0.3, [](QrsCandidate& c) { c.shape = kWide, c.sharpness *= 0.7; });
  }
  return patient.confidence(at_s);
}

TEST(BeatDecision, WhereMostCyclesHaveAnotherThatLooksAsMuchLikeAQrsComplexABeatIsDoubtful) {
  EXPECT_GT(told_with_rivals(2), 0.9);
  EXPECT_EQ(told_with_rivals(3), 0.5);
}

// A P wave, too small to be learnt of, has the shape of the beats.
TEST(BeatDecision, ASmallWaveOfTheBeatsShapeBeforeEachIsNoted) {
  const auto told = [](bool with_waves) {
    Known patient;
    for (int i = 0; i < 20; ++i) {
      const double at_s = patient.last_s + 0.8;
      if (with_waves) patient.see(at_s - 0.16, weaker(0.09));
      patient.see(at_s);
    }
    return patient.confidence(patient.last_s);
  };
  EXPECT_GT(told(false), 0.9);
  EXPECT_EQ(told(true), 0.5) << "some of its kind are followed by sharper ones";
}

TEST(BeatDecision, PeaksOfOneKindAreFoundUpToThreeStepsApart) {
  const auto confidence = [](double steps) {
    Patient patient;
    patient.beats(40, 0.8, shaped(wave(1.0, 1.2, 14.0)));
    const double beat_s = patient.last_s + 0.8;
    patient.see(beat_s, shaped(wave(1.0, 1.2, 14.0 + steps)));
    return patient.confidence(beat_s);
  };
  EXPECT_GT(confidence(3.0), 0.5);
  EXPECT_LE(confidence(4.0), 0.5);
}

// What recurs in a burst might be one of its arcs.
TEST(BeatDecision, AKindIsBelievedWhenItHasBeenKnownForLongerThanBurstsLast) {
  Known patient(60);
  const double first_s = patient.last_s + 0.8;
  patient.beats(60, 0.8, shaped(kWide));
  EXPECT_LE(patient.confidence(first_s + 21.6), 0.5);
  EXPECT_GT(patient.confidence(first_s + 30.4), 0.5);
}

TEST(BeatDecision, ABeatAmongDisturbancesIsLostUnlessItIsOfAKnownKind) {
  Disturbed patient(2, 0.3);
  const double beat_s = patient.familiar_s + 0.8;
  patient.see(beat_s, shaped(like_beat(0.7)));
  const auto lost = patient.told_at(beat_s);
  ASSERT_TRUE(lost);
  EXPECT_NEAR(lost->confidence, 0.25, 1e-9);
  EXPECT_NEAR(to_seconds(lost->deviation), 0.150 / std::sqrt(3.0), 0.002);
}

TEST(BeatDecision, AnEarlyBeatThatIsNotQuiteOfAKindIsLostAmongManyDisturbances) {
  const auto confidence = [](double cycles) {
    Known patient;
    patient.run(patient.last_s + 0.3);
    for (int i = 0; i < 12; ++i) {
      patient.decision.consider(patient.complex(patient.last_s + 0.2 + 0.005 * i,
                                                [&](QrsCandidate& c) {
                                                  c.shape = strange_shape(static_cast<unsigned>(i) + 50);
                                                  c.energy *= 5.0 + 2.0 * i;
                                                  c.rough = 50.0 * c.energy;
                                                  c.step = 3.0;
                                                }),
                                CandidateSettings{}.one_complex, at(patient.now_s));
    }
    const double beat_s = patient.last_s + cycles * 0.8;
    patient.see(beat_s, shaped(like_beat(0.88)));
    return patient.confidence(beat_s);
  };
  EXPECT_NEAR(confidence(0.80), 0.1, 1e-9);
  EXPECT_NEAR(confidence(0.92), 0.5, 1e-9);
}

// The gain or the conduction has changed while disturbances kept anything from being settled.
TEST(BeatDecision, FiveBeatsInARowOfOneNewKindAreTheUsualOnes) {
  const auto settled = [](int count) {
    Known patient(40, 0.5);
    patient.run(patient.last_s + 0.2);
    for (int i = 0; i < 12; ++i) {
      patient.decision.consider(patient.complex(patient.last_s + 0.18 + 0.065 * (i % 3),
                                                [&](QrsCandidate& c) {
                                                  c.energy *= 5.0,
                                                      c.shape = strange_shape(static_cast<unsigned>(i) + 50);
                                                }),
                                CandidateSettings{}.one_complex, at(patient.now_s));
    }
    patient.decision.restart(at(patient.now_s));
    patient.beats(count, 0.5, shaped(kWide));
    patient.run(patient.last_s + 0.3);
    const QrsClusters& clusters = patient.decision.clusters();
    return clusters.settled(clusters.nearest(kWide, 0).of);
  };
  EXPECT_FALSE(settled(6)) << "the third recurs";
  EXPECT_TRUE(settled(7));
}

// ---- what a burst hides

// Complexes that are too large for beats follow each other, so that none is told, for so long.
bool learns_after(double length_s) {
  Known patient;
  const double familiar_s = patient.last_s;
  while (patient.last_s < familiar_s + length_s) {
    patient.see(patient.last_s + 0.2, [&](QrsCandidate& c) {
      c.shape = strange_shape(patient.number++);
      c.step = 1.0;
      c.energy *= 8.0;
    });
  }
  return patient.decision.learning(at(patient.now_s));
}

TEST(BeatDecision, NoBeatInABurstIsNoSilenceUntilItLastsLongerThanBursts) {
  EXPECT_FALSE(learns_after(8.0));
  EXPECT_FALSE(learns_after(24.0));
  EXPECT_TRUE(learns_after(27.0));
}

TEST(BeatDecision, BeatsAreAsBeforeWhenOneOfAKnownKindAndSizeCame) {
  const auto as_before = [](double gain) {
    Known patient;
    patient.run(patient.last_s + 0.5);
    patient.decision.fall_silent();
    EXPECT_FALSE(patient.decision.as_before());
    patient.see(patient.last_s + 0.8, shaped(like_beat(1.0, gain)));
    patient.run(patient.last_s + 0.6);
    return patient.decision.as_before();
  };
  EXPECT_TRUE(as_before(1.0));
  EXPECT_TRUE(as_before(0.8));
  EXPECT_FALSE(as_before(0.65));
}

// ---- rhythm

TEST(BeatDecision, IntervalsInWhichABurstMayHaveHiddenBeatsTeachNoRhythm) {
  const auto taught = [](bool burst) {
    Known patient;
    for (int i = 0; i < 12; ++i) {
      patient.run(patient.last_s + 0.5);
      if (burst) patient.decision.burst();
      patient.see(patient.last_s + 1.5);
    }
    patient.run(patient.last_s + 0.3);
    return !patient.decision.learning(at(patient.last_s + 3.5));  // how long it is waited for the next tells
  };
  EXPECT_TRUE(taught(false));
  EXPECT_FALSE(taught(true));
}

TEST(BeatDecision, OnlyBeatsThatAreLikelyEnoughTeachTheRhythm) {
  // Every second beat is so weak; the interval is long, so that how long it is waited for the next tells whether it
  // was learnt.
  const auto taught = [](std::initializer_list<double> weaknesses, double least, double most) {
    Known patient;
    for (const double weakness : weaknesses) {
      patient.see(patient.last_s + 1.5,
                  [&](QrsCandidate& c) { c.sharpness *= weakness, c.energy *= std::sqrt(weakness); });
      const double confidence = patient.confidence(patient.last_s);
      EXPECT_GT(confidence, least);
      EXPECT_LT(confidence, most);
      patient.see(patient.last_s + 1.5);
    }
    patient.run(patient.last_s + 0.3);
    return !patient.decision.learning(at(patient.last_s + 3.5));
  };
  EXPECT_TRUE(taught({0.13, 0.13, 0.13, 0.13, 0.13, 0.13}, 0.97, 1.0));
  EXPECT_FALSE(taught({0.067, 0.067, 0.08, 0.085, 0.09, 0.095}, 0.78, 0.96));
}

// Where one beat in ten is a ventricular one it comes early by many deviations of the rhythm, each time.
TEST(BeatDecision, WhatComesEarlyInAKindThatDoesIsBelieved) {
  const QrsShape ectopic = wave(-1.0, 2.5);
  Known patient;
  for (int i = 0; i < 8; ++i) {
    patient.see(patient.last_s + 0.5, shaped(ectopic));
    patient.beats(1, 1.1);
    patient.beats(9);
  }
  const double early_s = patient.last_s + 0.5;
  patient.see(early_s, shaped(between(ectopic, kWide, 0.95)));
  patient.beats(1, 1.1);
  patient.beats(9);
  const double usual_s = patient.last_s + 0.5;
  patient.see(usual_s, shaped(like_beat(0.95)));
  EXPECT_GT(patient.confidence(early_s), 0.9);
  EXPECT_EQ(patient.confidence(usual_s), 0.5) << "of a kind that comes on time";
}

}  // namespace
}  // namespace perimap::test
