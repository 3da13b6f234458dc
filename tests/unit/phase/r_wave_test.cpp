// Which wave of a complex is told as its R peak, and how sure its time is.
#include <gtest/gtest.h>

#include <optional>

#include "decision_patient.hpp"

namespace perimap {
namespace {

using test::at;
using test::Disturbed;
using test::Known;
using test::like_beat;
using test::seconds;
using test::strange_shape;
using test::weaker;

constexpr double kCycle_s = 0.8;

test::Change other_wave(const QrsShape& shape, double after_s, double mV) {
  return [=](QrsCandidate& c) {
    c.shape = shape;
    c.peak_mV = 1.0;
    c.larger = {c.time + from_seconds(after_s), std::chrono::milliseconds(2), mV};
  };
}

// How long after the peak that was measured a complex of a known patient is told to be.
double told_after_s(const QrsShape& shape, double after_s, double mV) {
  Known patient;
  const double at_s = patient.last_s + kCycle_s;
  patient.see(at_s, other_wave(shape, after_s, mV));
  patient.run(at_s + 1.2);
  return seconds(patient.told.back().time) - at_s;
}

TEST(RWave, OfAComplexThatIsNotExactlyLikeItsKindItIsTheLargest) {
  EXPECT_NEAR(told_after_s(like_beat(0.95), 0.03, 1.3), 0.03, 1e-6);
  EXPECT_NEAR(told_after_s(like_beat(0.95), 0.03, -1.3), 0.03, 1e-6);
  EXPECT_NEAR(told_after_s(like_beat(0.95), -0.03, 1.3), -0.03, 1e-6);
  EXPECT_NEAR(told_after_s(like_beat(0.95), 0.03, 1.15), 0.0, 1e-6) << "but where they are of about one size";
  EXPECT_NEAR(told_after_s(like_beat(0.99), 0.03, 1.6), 0.0, 1e-6) << "it is where the kind has it";
}

TEST(RWave, ItsDeviationIsThatOfTheWaveThatIsTold) {
  Known patient;
  const double at_s = patient.last_s + kCycle_s;
  patient.see(at_s, other_wave(like_beat(0.95), 0.02, 1.3));
  const auto told = patient.told_at(at_s + 0.02);
  ASSERT_TRUE(told);
  EXPECT_NEAR(to_seconds(told->deviation), 0.002, 1e-6);
}

// Where the beats are 1 mV high.
TEST(RWave, InNoiseItIsTheOneThatPointsAsTheBeatsDoAndIsAsLarge) {
  const auto told_before_s = [](double mV) {
    Disturbed patient(2, 0.3);
    const double at_s = patient.familiar_s + kCycle_s;
    patient.see(at_s, [&](QrsCandidate& c) {
      c.shape = like_beat(0.7);
      c.peak_mV = -1.5;
      c.larger = {c.time + std::chrono::milliseconds(20), {}, -2.0};
      c.upright = {c.time - std::chrono::milliseconds(70), {}, mV};
    });
    patient.run(at_s + 1.2);
    EXPECT_GE(to_seconds(patient.told.back().deviation), 0.08);
    return at_s - seconds(patient.told.back().time);
  };
  EXPECT_NEAR(told_before_s(0.6), 0.07, 1e-6);
  EXPECT_NEAR(told_before_s(0.4), 0.0, 1e-6);
}

// As far as the measures of a line without a QRS complex tell.
TEST(RWave, WhereTheLineStaysAwayTheBeatMayBeAnywhere) {
  const auto deviation_s = [](double step, const QrsShape& shape) {
    Known patient;
    const double at_s = patient.last_s + kCycle_s;
    patient.see(at_s, [&](QrsCandidate& c) { c.shape = shape, c.step = step; });
    const auto told = patient.told_at(at_s);
    return told ? to_seconds(told->deviation) : -1.0;
  };
  EXPECT_NEAR(deviation_s(0.0, strange_shape(91)), 0.001, 1e-6);
  EXPECT_NEAR(deviation_s(0.8, strange_shape(91)), 0.087, 1e-6);
  EXPECT_NEAR(deviation_s(0.8, like_beat(0.99)), 0.001, 1e-6) << "a beat on a line that moves is one";
}

TEST(RWave, WhatIsMoreLikelyNoneByItselfMayBeAnywhere) {
  int seen = 0;
  for (double by = 1.0; by > 0.1; by *= 0.9) {
    Known patient;
    const double at_s = patient.last_s + kCycle_s;
    const auto weak = [&](QrsCandidate& c) { weaker(by)(c), c.shape = strange_shape(92); };
    const double odds = test::by_itself(patient, patient.complex(at_s, weak));
    patient.see(at_s, weak);
    const auto told = patient.told_at(at_s);
    if (!told || std::abs(odds) < 0.2) continue;
    seen += odds < 0.0 ? 1 : 0;
    EXPECT_NEAR(to_seconds(told->deviation), odds < 0.0 ? 0.087 : 0.001, 1e-6) << by;
  }
  EXPECT_GT(seen, 0);
}

}  // namespace
}  // namespace perimap
