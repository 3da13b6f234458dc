// What is told of complexes as they are measured: each test says what one setting of the decision is for.
#include "core/phase/beat_decision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "core/phase/ecg_filter.hpp"

namespace perimap {
namespace {

double seconds(Instant t) { return to_seconds(t.time_since_epoch()); }
Instant at(double t_s) { return Instant(from_seconds(t_s)); }

// The slope of a wave of that height and width in steps of 5 ms.
QrsShape wave(double height, double width, double middle = 18.0) {
  QrsShape s;
  s.points = 28;
  for (int i = 0; i < s.points; ++i) {
    const double x = (i - middle) / width;
    s.slope[static_cast<std::size_t>(i)] = static_cast<float>(-height * x * std::exp(-0.5 * x * x));
  }
  return s;
}
const QrsShape kBeat = wave(1.0, 2.5);
const QrsShape kWide = wave(1.0, 7.0, 12.0);

// As like kBeat as the correlation says, and otherwise like something else.
QrsShape like_beat(double correlation, double gain = 1.0) {
  QrsShape other = kWide;
  const double along = match(other, kBeat).gain;
  for (int i = 0; i < other.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    other.slope[k] -= static_cast<float>(along) * kBeat.slope[k];
  }
  const double across = std::sqrt(1.0 - correlation * correlation) * root_mean_square(kBeat) / root_mean_square(other);
  QrsShape shape = kBeat;
  for (int i = 0; i < shape.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    shape.slope[k] = static_cast<float>(
        gain * (correlation * static_cast<double>(kBeat.slope[k]) + across * static_cast<double>(other.slope[k])));
  }
  return shape;
}

// A shape that is like no other number's.
QrsShape strange_shape(unsigned number) {
  std::mt19937 generator(number);
  std::normal_distribution<float> normal(0.0F, 0.4F);
  QrsShape s;
  s.points = 28;
  for (int i = 0; i < s.points; ++i) s.slope[static_cast<std::size_t>(i)] = normal(generator);
  return s;
}

using Change = std::function<void(QrsCandidate&)>;
void none(QrsCandidate&) {}

// A patient whose complexes are measured so long after their peak.
struct Patient {
  static constexpr double kMeasured_s = 0.095;

  // Levels of a line with beats, and of that noise between them.
  explicit Patient(double noise_mV = 0.005, double height_mV = 1.0) {
    EcgFilter filter;
    filter.restart(from_seconds(1.0 / 250.0));
    std::mt19937_64 generator(0x58d1e0b37a94c62fU);
    std::normal_distribution<double> noise(0.0, noise_mV);
    for (int i = 0; i < 15 * 250; ++i) {
      const double x = std::remainder(i / 250.0 - 0.4, 0.8) / 0.012;
      filter.push(at(i / 250.0), height_mV * std::exp(-0.5 * x * x) + noise(generator), false);
      levels.follow(filter, 0.0, false);
    }
    decision.restart(at(0.0));
  }

  [[nodiscard]] QrsCandidate complex(double at_s, const Change& change = none) const {
    QrsCandidate c;
    c.time = at(at_s);
    c.deviation = std::chrono::milliseconds(1);
    c.shape = kBeat;
    c.energy = levels.top_energy();
    c.sharpness = levels.top_sharpness();
    c.slope = 0.8;
    c.upward = 1.0;
    change(c);
    return c;
  }
  void run(double until_s) {
    for (; now_s < until_s; now_s += 0.004) {
      decision.decide(at(now_s), false);
      while (const auto peak = decision.pop()) told.push_back(*peak);
    }
  }
  // A complex at that time, and what is decided until it is measured.
  void see(double at_s, const Change& change = none) {
    run(at_s + kMeasured_s);
    decision.consider(complex(at_s, change), CandidateSettings{}.one_complex, at(now_s));
    last_s = at_s;
  }
  // So many usual beats, the first a cycle after the last complex.
  void beats(int count, double cycle_s = 0.8, const Change& change = none) {
    for (int i = 0; i < count; ++i) see(last_s + cycle_s, change);
  }
  // Complexes of a beat's size and of all shapes.
  void strangers(int count, double apart_s, double size = 1.0) {
    for (int i = 0; i < count; ++i) {
      see(last_s + apart_s, [&](QrsCandidate& c) {
        c.shape = strange_shape(number++);
        c.energy *= size;
        c.sharpness *= size;
      });
    }
  }
  [[nodiscard]] std::optional<RPeak> told_at(double at_s) {
    run(at_s + 1.2);
    const auto peak =
        std::find_if(told.begin(), told.end(), [&](const RPeak& p) { return std::abs(seconds(p.time) - at_s) < 0.03; });
    return peak == told.end() ? std::nullopt : std::optional(*peak);
  }
  [[nodiscard]] double delay_s(double at_s) {
    const auto peak = told_at(at_s);
    return peak ? to_seconds(peak->detected_at - peak->time) : -1.0;
  }
  [[nodiscard]] double confidence(double at_s) {
    const auto peak = told_at(at_s);
    return peak ? peak->confidence : -1.0;
  }

  DecisionSettings settings;
  EcgLevels levels{EcgLevelSettings{}};
  BeatDecision decision{settings, levels};
  std::vector<RPeak> told;
  double now_s = 0.0;
  double last_s = 0.2;
  unsigned number = 1;
};

// A patient whose beats have been known for long.
struct Known : Patient {
  explicit Known(int count = 40, double cycle_s = 0.8, double noise_mV = 0.005) : Patient(noise_mV) {
    beats(count, cycle_s);
  }
};

Change shaped(const QrsShape& shape) {
  return [=](QrsCandidate& c) { c.shape = shape; };
}
Change weaker(double by) {
  return [=](QrsCandidate& c) { c.energy *= by, c.sharpness *= by; };
}

// ---- when a beat is told

TEST(BeatDecision, ABeatOfAKnownKindIsToldAtOnce) {
  Known patient;
  patient.see(patient.last_s + 0.8);
  EXPECT_LT(patient.delay_s(patient.last_s), 0.12);
  EXPECT_GT(patient.confidence(patient.last_s), 0.99);
}

// By itself, among the patient's levels.
double by_itself(const Patient& patient, const QrsCandidate& candidate) {
  ComplexContext context;
  context.top_energy = patient.levels.top_energy();
  context.top_sharpness = patient.levels.top_sharpness();
  context.quiet_energy = patient.levels.quiet();
  return log_odds(evidence_of(candidate, context), kFittedWeights.complex);
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
      EXPECT_NEAR(delay_s, 0.245, 0.03);
      last_sure = alone;
    } else if (delay_s < 0.40) {
      EXPECT_NEAR(delay_s, 0.330, 0.01);
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
    c.step = 3.0;
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
  EXPECT_NEAR(delay_s(1.0), 0.240, 0.02);
  EXPECT_NEAR(delay_s(0.90), 0.240, 0.02);
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
  EXPECT_NEAR(longest_s(3), 0.330, 0.01);
  EXPECT_LT(longest_s(4), 0.12) << "so many are followed by chance";
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
    patient.decision.consider(patient.complex(patient.last_s + after_s, [](QrsCandidate& c) { c.energy *= 5.0; }),
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
  const auto noisy = [](double energy) {
    Known patient;
    patient.see(patient.last_s + 0.8, [&](QrsCandidate& c) { c.energy *= energy; });
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_FALSE(noisy(3.5));
  EXPECT_TRUE(noisy(4.6));
}

// So large that it is a disturbance at once, of weight one; a few milliseconds after its time.
struct Disturbed : Known {
  explicit Disturbed(int count, double after_s = 0.8) {
    familiar_s = last_s;
    for (int i = 0; i < count; ++i) {
      run(familiar_s + after_s + Patient::kMeasured_s);
      decision.consider(
          complex(familiar_s + after_s + 0.07 * i,
                  [&](QrsCandidate& c) { c.energy *= 5.0, c.shape = strange_shape(static_cast<unsigned>(i) + 50); }),
          CandidateSettings{}.one_complex, at(now_s));
    }
    disturbed_s = familiar_s + after_s + 0.07 * (count - 1);
    decision.restart(at(now_s));  // what waits is lost: no other disturbance comes of it
  }
  double familiar_s = 0.0;
  double disturbed_s = 0.0;
};

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
  const auto noisy = [](double apart_s, double by = 1.0) {
    Known patient;
    const double first_s = patient.last_s + 0.8;
    patient.see(first_s);
    patient.run(first_s + 0.12);
    patient.see(first_s + apart_s, weaker(by));
    return patient.decision.noisy(at(patient.now_s));
  };
  EXPECT_FALSE(noisy(0.095));
  EXPECT_TRUE(noisy(0.130));
  EXPECT_TRUE(noisy(0.225));
  EXPECT_FALSE(noisy(0.262));
  double least = 10.0;
  for (double by = 1.0; by > 0.2; by *= 0.97) {
    const Known patient;
    // The one before is a sharper one within the T wave's time.
    if (noisy(0.15, by)) least = std::min(least, by_itself(patient, patient.complex(1.0, weaker(by))) + std::log(by));
  }
  EXPECT_NEAR(least, 0.7, 0.15);
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
  EXPECT_GT(confidence(0.44, kBeat), 0.5);
  EXPECT_LE(confidence(0.36, kBeat), 0.5) << "whatever it is like";
  EXPECT_GT(confidence(0.75, like_beat(0.88)), 0.5);
  EXPECT_LE(confidence(0.65, like_beat(0.88)), 0.5) << "where it is less like the others";
  EXPECT_GT(confidence(0.6, like_beat(0.95)), 0.5);
  EXPECT_GT(confidence(0.6, like_beat(1.0, std::exp(0.26))), 0.5);
  EXPECT_LE(confidence(0.6, like_beat(1.0, std::exp(0.34))), 0.5) << "or of another size";
}

TEST(BeatDecision, WhatIsUnlikeTheBeatsIsDoubtful) {
  const auto confidence = [](const Change& change) {
    Known patient;
    const double beat_s = patient.last_s + 0.8;
    patient.see(beat_s, change);
    return patient.confidence(beat_s);
  };
  EXPECT_GT(confidence(shaped(like_beat(0.83))), 0.5);
  EXPECT_NEAR(confidence(shaped(like_beat(0.77))), 0.5, 1e-9);
  EXPECT_GT(confidence([](QrsCandidate& c) { c.step = 0.68; }), 0.5);
  EXPECT_NEAR(confidence([](QrsCandidate& c) { c.step = 0.82; }), 0.5, 1e-9);
  EXPECT_GT(confidence([](QrsCandidate& c) { c.rough = 0.45 * c.energy; }), 0.5);
  EXPECT_NEAR(confidence([](QrsCandidate& c) { c.rough = 0.55 * c.energy; }), 0.5, 1e-9);
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

// ---- rhythm

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
  EXPECT_TRUE(taught({0.13, 0.13, 0.13, 0.13, 0.13, 0.13}, 0.84, 1.0));
  EXPECT_FALSE(taught({0.067, 0.067, 0.08, 0.085, 0.09, 0.095}, 0.54, 0.79));
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
}  // namespace perimap
