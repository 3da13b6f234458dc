#include "core/phase/beat_classer.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/r_trigger.hpp"
#include "core/phase/rhythm_monitor.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

// One period of a sine, fast for a normal complex and slow for a ventricular one.
QrsShape shape(double cycles) {
  QrsShape s;
  s.points = 29;
  for (int i = 0; i < s.points; ++i)
    s.slope[static_cast<std::size_t>(i)] = static_cast<float>(std::sin(cycles * 0.22 * i));
  return s;
}

class Classed : public testing::Test {
 protected:
  BeatClass beat(int after_ms, double cycles = 1.0, double confidence = 0.9) {
    t_ += milliseconds(after_ms);
    RPeak peak{t_, t_ + milliseconds(95), confidence, milliseconds(1)};
    peak.shape = shape(cycles);
    last_ = classer_.classify(peak);
    return last_.beat_class;
  }
  void settle() {
    for (int i = 0; i < 20; ++i) EXPECT_EQ(beat(800 + 10 * (i % 3)), BeatClass::kNormal);
  }

  // Early ones, every fifth beat.
  void ventricular_beats() {
    for (int i = 0; i < 6; ++i) {
      EXPECT_EQ(beat(550, 0.4), BeatClass::kPremature);
      EXPECT_EQ(beat(1050), BeatClass::kNormal);
      for (int k = 0; k < 3; ++k) EXPECT_EQ(beat(805), BeatClass::kNormal);
    }
  }

  Instant t_ = from_ns(1'000'000'000);
  BeatClasser classer_;
  RPeak last_;
};

TEST_F(Classed, VentricularBeatIsPrematureAndTheBeatAfterItsPauseIsNormal) {
  settle();
  EXPECT_EQ(beat(550, 0.4), BeatClass::kPremature);
  EXPECT_TRUE(last_.unusual_shape);
  EXPECT_EQ(beat(1050), BeatClass::kNormal);
  EXPECT_FALSE(last_.unusual_shape);
}

// They are narrow, come before the pacemaker's, and keep it still; ventricular ones are wide or come too early.
TEST_F(Classed, APacedHeartsOwnBeatsAreNormalAndItsVentricularOnesAreNot) {
  for (int i = 0; i < 20; ++i) EXPECT_EQ(beat(800, 0.7), BeatClass::kNormal);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(beat(690, 1.0), BeatClass::kNormal) << i;
    EXPECT_EQ(beat(670, 1.0), BeatClass::kNormal) << i;
    EXPECT_EQ(beat(800, 0.7), BeatClass::kNormal) << i;
    EXPECT_EQ(beat(800, 0.7), BeatClass::kNormal) << i;
    EXPECT_EQ(beat(590, 0.3), BeatClass::kPremature) << i;
    EXPECT_EQ(beat(800, 0.7), BeatClass::kNormal) << i;
  }
}

// From three quarters of the cycle on.
TEST_F(Classed, APacedHeartsOwnBeatIsPrematureWhenItComesFarTooEarly) {
  for (const int after_ms : {580, 600}) {
    classer_ = {};
    for (int i = 0; i < 20; ++i) EXPECT_EQ(beat(800, 0.7), BeatClass::kNormal);
    EXPECT_EQ(beat(after_ms, 1.0), after_ms < 590 ? BeatClass::kPremature : BeatClass::kNormal) << after_ms;
  }
}

// So doubtful that it is no ventricular one, and hardly another shape: its time alone tells.
TEST_F(Classed, WhatIsHalfAPacedHeartsOwnMayComeEarly) {
  for (const int after_ms : {585, 600}) {
    classer_ = {};
    for (int i = 0; i < 20; ++i) EXPECT_EQ(beat(800, 0.7), BeatClass::kNormal);
    EXPECT_EQ(beat(after_ms, 0.98, 0.2), after_ms < 590 ? BeatClass::kPremature : BeatClass::kNormal) << after_ms;
  }
}

// The atria fibrillate: after some beats it is known that this kind comes at any time.
TEST_F(Classed, APacedHeartsOwnBeatsThatComeAtAnyTimeAreNormalWhenOneIsFarTooEarly) {
  for (int i = 0; i < 20; ++i) EXPECT_EQ(beat(800, 0.7), BeatClass::kNormal);
  const auto own_beats = [&](std::initializer_list<int> after_ms) {
    for (const int ms : after_ms) {
      beat(ms, 1.0);
      for (int i = 0; i < 3; ++i) beat(800, 0.7);
    }
  };
  own_beats({790, 620, 750, 600, 780, 620});
  EXPECT_EQ(beat(500, 1.0), BeatClass::kNormal);
  classer_ = {};
  for (int i = 0; i < 20; ++i) EXPECT_EQ(beat(800, 0.7), BeatClass::kNormal);
  own_beats({500, 510, 500, 490, 500, 510});
  EXPECT_EQ(beat(500, 1.0), BeatClass::kPremature) << "coupled";
}

TEST_F(Classed, BigeminyStaysBigeminy) {
  settle();
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(beat(550, 0.4), BeatClass::kPremature) << i;
    EXPECT_EQ(beat(1050), BeatClass::kNormal) << i;
  }
}

TEST_F(Classed, VentricularBeatThatComesOnTimeIsNoneTheLessOne) {
  settle();
  EXPECT_EQ(beat(810, 0.4), BeatClass::kNormal) << "a shape never seen before may be noise";
  settle();
  ventricular_beats();
  EXPECT_EQ(beat(810, 0.4), BeatClass::kPremature);
  EXPECT_TRUE(last_.unusual_shape);
  EXPECT_EQ(beat(810), BeatClass::kNormal);
}

TEST_F(Classed, ConductionThatHasChangedIsNormalFromItsFifthBeatOn) {
  settle();
  for (int i = 0; i < 6; ++i) {
    beat(805, 0.4);
    for (int k = 0; k < 4; ++k) EXPECT_EQ(beat(805), BeatClass::kNormal);
  }
  for (int i = 0; i < 4; ++i) EXPECT_EQ(beat(800, 0.4), BeatClass::kPremature) << i;
  for (int i = 0; i < 40; ++i) EXPECT_EQ(beat(800 + 10 * (i % 3), 0.4), BeatClass::kNormal) << i;
}

// A run of ventricular beats at the rate of the usual ones, and at last another conduction after all.
TEST_F(Classed, ARunOfAKindThatHasComeEarlyIsVentricularForTwelveBeats) {
  settle();
  ventricular_beats();
  for (int i = 0; i < 12; ++i) EXPECT_EQ(beat(800, 0.4), BeatClass::kPremature) << i;
  for (int i = 0; i < 40; ++i) EXPECT_EQ(beat(800 + 10 * (i % 3), 0.4), BeatClass::kNormal) << i;
}

TEST_F(Classed, InterpolatedBeatDoesNotMakeTheNextPremature) {
  settle();
  EXPECT_EQ(beat(400, 0.4), BeatClass::kPremature);
  EXPECT_EQ(beat(410), BeatClass::kNormal);
}

TEST_F(Classed, AtrialBeatIsPrematureInTheUsualShape) {
  settle();
  EXPECT_EQ(beat(520), BeatClass::kPremature);
  EXPECT_FALSE(last_.unusual_shape);
  EXPECT_EQ(beat(900), BeatClass::kNormal);
}

TEST_F(Classed, ASuddenFasterRhythmIsNormalFromItsSecondBeat) {
  settle();
  EXPECT_EQ(beat(500), BeatClass::kPremature);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(beat(500 + 5 * (i % 2)), BeatClass::kNormal) << i;
}

TEST_F(Classed, LateBeatEndsAPause) {
  settle();
  EXPECT_EQ(beat(1500), BeatClass::kPause);
  EXPECT_EQ(beat(810), BeatClass::kNormal);
}

TEST_F(Classed, DoubtfulStrangeShapeOutOfRhythmIsNoise) {
  settle();
  EXPECT_EQ(beat(450, 0.4, 0.2), BeatClass::kNoise);
  EXPECT_EQ(beat(360), BeatClass::kNormal);
}

// ---- what each limit is for

// Beside the usual shape, as like it as the correlation says.
QrsShape like_usual(double correlation, double gain = 1.0) {
  const QrsShape usual = shape(1.0);
  QrsShape other = shape(0.4);
  const double along = match(other, usual).gain;
  for (int i = 0; i < other.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    other.slope[k] -= static_cast<float>(along) * usual.slope[k];
  }
  const double across = std::sqrt(1.0 - correlation * correlation) * root_mean_square(usual) / root_mean_square(other);
  QrsShape s = usual;
  for (int i = 0; i < s.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    s.slope[k] = static_cast<float>(
        gain * (correlation * static_cast<double>(usual.slope[k]) + across * static_cast<double>(other.slope[k])));
  }
  return s;
}

// Regular beats of 0.8 s.
struct Steady : Classed {
  BeatClass see(int after_ms, const QrsShape& of, double confidence = 0.9) {
    t_ += milliseconds(after_ms);
    RPeak peak{t_, t_ + milliseconds(95), confidence, milliseconds(1)};
    peak.shape = of;
    last_ = classer_.classify(peak);
    return last_.beat_class;
  }
  void settle() {
    for (int i = 0; i < 20; ++i) see(800, shape(1.0));
  }
  // As beats are: like the usual one to 0.995 and to a tenth of its size.
  QrsShape usual_beat() {
    ++beat_;
    return like_usual(0.995, 1.0 + 0.1 * std::sin(1.7 * beat_));
  }

  int beat_ = 0;
};

TEST_F(Steady, ABeatIsOfTheUsualShapeFromACorrelationOfNineTenthsOn) {
  settle();
  see(800, like_usual(0.93));
  EXPECT_FALSE(last_.unusual_shape);
  see(800, like_usual(0.86));
  EXPECT_TRUE(last_.unusual_shape);
}

TEST_F(Steady, ABeatOfTheUsualShapeIsPrematureWhenItIsMuchTooEarly) {
  settle();
  EXPECT_EQ(see(670, shape(1.0)), BeatClass::kNormal) << "0.84 of the cycle";
  settle();
  EXPECT_EQ(see(610, shape(1.0)), BeatClass::kPremature) << "0.76";
}

TEST_F(Steady, AnUnknownShapeIsVentricularWhenItIsEarlyAndNotWhenItIsOnTime) {
  const QrsShape large = shape(0.4);
  settle();
  EXPECT_EQ(see(690, large), BeatClass::kPremature) << "0.86 of the cycle";
  settle();
  EXPECT_EQ(see(800, large), BeatClass::kNormal);
  EXPECT_TRUE(last_.unusual_shape);
}

TEST_F(Steady, APauseIsOverOneAndAHalfCycles) {
  settle();
  EXPECT_EQ(see(1150, shape(1.0)), BeatClass::kNormal);
  settle();
  EXPECT_EQ(see(1250, shape(1.0)), BeatClass::kPause);
}

TEST_F(Steady, AfterFourCyclesBeatsWereMissed) {
  settle();
  EXPECT_EQ(see(3000, shape(1.0)), BeatClass::kPause);
  settle();
  EXPECT_EQ(see(3400, shape(1.0)), BeatClass::kNormal) << "the interval means nothing";
}

TEST_F(Steady, DoubtfulBeatsThatAreNotDueAreNoise) {
  const auto noise = [&](const QrsShape& of, double confidence) {
    settle();
    const bool none = see(500, of, confidence) == BeatClass::kNoise;
    settle();
    return none;
  };
  EXPECT_TRUE(noise(like_usual(0.5), 0.27));
  EXPECT_FALSE(noise(like_usual(0.5), 0.34));
  EXPECT_TRUE(noise(shape(1.0), 0.13));
  EXPECT_FALSE(noise(shape(1.0), 0.17));
}

TEST_F(Steady, ADoubtfulBeatIsNoneUnlessItIsDueAfterOneCycleOrTwo) {
  const auto noise = [&](int after_ms) {
    settle();
    const bool none = see(after_ms, shape(1.0), 0.1) == BeatClass::kNoise;
    settle();
    return none;
  };
  EXPECT_FALSE(noise(900)) << "an eighth of a cycle late";
  EXPECT_TRUE(noise(950)) << "a fifth";
  EXPECT_FALSE(noise(1600));
  EXPECT_TRUE(noise(2400));
}

TEST_F(Steady, ALongCycleTeachesTheRhythmByAThirdMoreAtMost) {
  settle();
  for (int i = 0; i < 5; ++i) see(1180, shape(1.0));
  // The rhythm's cycle is 1.08 s now: three quarters of it are much too early, as they are not of 0.8 s.
  EXPECT_EQ(see(1580, shape(1.0)), BeatClass::kNormal);
  EXPECT_EQ(see(1700, shape(1.0)), BeatClass::kPause);
}

TEST_F(Steady, PeaksOfWideComplexesAreFoundUpToTwentyMillisecondsApart) {
  const auto displaced = [](int steps) {
    QrsShape s;
    s.points = 29;
    for (int i = 0; i < s.points; ++i) {
      const double x = (i - 14.0 - steps) / 1.2;
      s.slope[static_cast<std::size_t>(i)] = static_cast<float>(-x * std::exp(-0.5 * x * x));
    }
    return s;
  };
  for (int i = 0; i < 20; ++i) see(800, displaced(0));
  see(800, displaced(4));
  EXPECT_FALSE(last_.unusual_shape);
  see(800, displaced(5));
  EXPECT_TRUE(last_.unusual_shape);
}

TEST_F(Classed, InFibrillationNoBeatOfTheUsualShapeIsPrematureAndALargeEarlyOneIs) {
  std::mt19937 generator(11);
  std::uniform_int_distribution<int> interval(400, 1100);
  for (int i = 0; i < 60; ++i) beat(interval(generator));
  int premature = 0;
  for (int i = 0; i < 60; ++i) premature += beat(interval(generator)) == BeatClass::kPremature ? 1 : 0;
  EXPECT_EQ(premature, 0);
  beat(750);
  EXPECT_EQ(beat(400, 0.4), BeatClass::kPremature);
  EXPECT_TRUE(last_.unusual_shape);
}

TEST_F(Steady, AKindThatWasSeenThreeTimesMayComeOnTime) {
  const QrsShape large = shape(0.4);
  const auto on_time = [&](int seen) {
    classer_ = BeatClasser();
    for (int i = 0; i < 30; ++i) see(800, usual_beat());
    for (int i = 0; i < seen; ++i) {
      see(800, large);
      for (int k = 0; k < 4; ++k) see(800, usual_beat());
    }
    return see(800, large);
  };
  EXPECT_EQ(on_time(2), BeatClass::kNormal);
  EXPECT_EQ(on_time(3), BeatClass::kPremature);
}

// In a steady rhythm a tenth of a cycle is early, in one that scatters it is nothing.
TEST_F(Steady, HowEarlyABeatIsIsHeldAgainstTheScatterOfTheRhythm) {
  const auto seen = [&](int scatter_ms) {
    classer_ = BeatClasser();
    for (int i = 0; i < 80; ++i) see(800 + (i % 2 == 0 ? scatter_ms : -scatter_ms), usual_beat());
    see(800, usual_beat());
    return see(690, like_usual(0.92));
  };
  EXPECT_EQ(seen(10), BeatClass::kPremature);
  EXPECT_EQ(seen(90), BeatClass::kNormal);
}

// Of the usual shape to a correlation of 0.97, at half of its size.
TEST_F(Steady, ABeatOfNearlyTheUsualShapeIsVentricularWhereUsualOnesAreAlike) {
  for (int i = 0; i < 40; ++i) see(800, usual_beat());
  EXPECT_EQ(see(690, like_usual(0.97, 0.5)), BeatClass::kPremature);
  EXPECT_TRUE(last_.unusual_shape);
  see(910, usual_beat());
  EXPECT_EQ(see(690, usual_beat()), BeatClass::kNormal) << "as early, but a usual one";
  EXPECT_FALSE(last_.unusual_shape);
}

TEST_F(Steady, AnUnlikelyBeatThatNoiseMayHaveMadeIsNotVentricular) {
  for (int i = 0; i < 40; ++i) see(800, usual_beat());
  EXPECT_EQ(see(690, shape(0.4), 0.34), BeatClass::kPremature);
  see(910, usual_beat());
  EXPECT_EQ(see(690, shape(0.4), 0.28), BeatClass::kNormal) << "due";
}

// A run of other kinds, each beat as likely to be of either: early by the cycle before them, on time by their own.
TEST_F(Steady, WhereNoBeatHasTaughtTheCycleForEightTheCycleIsThatOfTheLatest) {
  const auto after_run = [&](int beats) {
    classer_ = BeatClasser();
    for (int i = 0; i < 40; ++i) see(800, usual_beat());
    for (int i = 0; i < beats; ++i) see(560 + i % 3, i % 2 == 0 ? shape(0.4) : like_usual(0.3));
    return see(600, usual_beat());
  };
  // From the ninth on the cycle learns, and half of the eight that it is the median of must be of the run.
  EXPECT_EQ(after_run(11), BeatClass::kPremature) << "0.75 of the cycle before";
  EXPECT_EQ(after_run(14), BeatClass::kNormal);
}

TEST_F(Classed, OnlyNormalCyclesTeach) {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  const auto take = [&](int after_ms, double cycles = 1.0) {
    beat(after_ms, cycles);
    tracker.on_r_peak(last_);
  };
  for (int i = 0; i < 30; ++i) take(800);
  take(500, 0.4);
  const Instant premature = t_;
  EXPECT_NEAR(to_seconds(tracker.clock().predicted_length(1)), 0.8, 1e-6);  // the short cycle taught nothing
  take(1100);
  take(800);
  const CardiacClock& clock = tracker.clock();
  EXPECT_TRUE(clock.cycle_at(premature - milliseconds(700)).teaches);
  EXPECT_FALSE(clock.cycle_at(premature - milliseconds(100)).teaches);
  EXPECT_FALSE(clock.cycle_at(premature + milliseconds(100)).teaches);
  EXPECT_TRUE(clock.cycle_at(premature + milliseconds(1200)).teaches);
  EXPECT_FALSE(clock.cycle_at(t_ + milliseconds(100)).teaches);  // not completed
  EXPECT_NEAR(to_seconds(clock.predicted_length()), 0.8, 1e-6);
}

TEST_F(Classed, NoiseIsNoBeatOfTheClock) {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  RPeak peak{t_, t_, 0.2, milliseconds(1), BeatClass::kNoise};
  tracker.on_r_peak(peak);
  EXPECT_EQ(tracker.clock().beats(), 0U);
}

// ---- rhythm

// Share of the time that a rhythm is called unpredictable, from the fortieth interval on.
template <class Interval>
double unpredictable(Interval&& interval) {
  int called = 0;
  int all = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 generator(seed);
    RhythmMonitor monitor;
    for (int i = 0; i < 200; ++i) {
      monitor.push(Seconds(interval(i, generator)));
      if (i < 40) continue;
      ++all;
      called += monitor.rhythm() == Rhythm::kUnpredictable ? 1 : 0;
    }
  }
  return static_cast<double>(called) / all;
}

double normal(std::mt19937& generator, double deviation) {
  return std::normal_distribution<double>(0.0, deviation)(generator);
}

TEST(RhythmMonitor, AtrialFibrillationIsUnpredictable) {
  for (const double mean : {0.45, 0.6, 0.8, 1.0}) {
    for (const double variation : {0.15, 0.2, 0.25}) {
      const double share = unpredictable([&](int, std::mt19937& generator) {
        const double shape = 1.0 / (variation * variation);
        return std::max(0.25, std::gamma_distribution<double>(shape, mean / shape)(generator));
      });
      EXPECT_GT(share, 0.97) << mean << " " << variation;
    }
  }
}

TEST(RhythmMonitor, PatternsAndBreathingAreNot) {
  EXPECT_EQ(unpredictable([](int, std::mt19937& g) { return 0.8 + normal(g, 0.02); }), 0.0);
  EXPECT_LT(unpredictable([](int i, std::mt19937& g) { return (i % 2 == 0 ? 0.55 : 1.05) + normal(g, 0.02); }), 0.01);
  const double three[] = {0.8, 0.5, 1.1};
  EXPECT_LT(unpredictable([&](int i, std::mt19937& g) { return three[i % 3] + normal(g, 0.02); }), 0.01);
  for (const double depth : {0.05, 0.1, 0.15, 0.2}) {
    const double share = unpredictable(
        [&](int i, std::mt19937& g) { return 0.9 * (1.0 + depth * std::sin(1.35 * i)) + normal(g, 0.015); });
    EXPECT_LT(share, 0.02) << depth;
  }
}

// A heart that varies by 8 %, beat for beat at random, is as hard to predict as the border has it.
TEST(RhythmMonitor, TheBorderIsAVariationOfATwelfth) {
  const auto varies = [](double variation) {
    return unpredictable([&](int, std::mt19937& g) { return 0.8 * (1.0 + normal(g, variation)); });
  };
  EXPECT_LT(varies(0.06), 0.03);
  EXPECT_NEAR(varies(0.08), 0.27, 0.06);
  EXPECT_GT(varies(0.12), 0.95);
}

TEST(RhythmMonitor, KnowsNothingAtFirst) {
  RhythmMonitor monitor;
  for (int i = 0; i < 20; ++i) monitor.push(Seconds(0.8));
  EXPECT_EQ(monitor.rhythm(), Rhythm::kUnknown);
}

// ---- hardware triggers

TEST(RTrigger, PulseBecomesAnRPeakEarlierByTheDelay) {
  RTrigger trigger({.delay = milliseconds(35), .deviation = milliseconds(3)});
  const Instant t = from_ns(5'000'000'000);
  const auto peak = trigger.push(t, t + milliseconds(2));
  ASSERT_TRUE(peak);
  EXPECT_EQ(peak->time, t - milliseconds(35));
  EXPECT_EQ(peak->detected_at, t + milliseconds(2));
  EXPECT_EQ(peak->deviation, milliseconds(3));
  EXPECT_FALSE(trigger.push(t + milliseconds(20), t + milliseconds(22)));  // a bounce
  EXPECT_FALSE(trigger.push(t - milliseconds(20), t + milliseconds(30)));
  EXPECT_TRUE(trigger.push(t + milliseconds(800), t + milliseconds(802)));
}

}  // namespace
}  // namespace perimap
