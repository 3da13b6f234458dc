#include "core/phase/ecg_line.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(2);

struct Given {
  Instant t;
  double mV;
  bool made_up;
};

struct Sink {
  std::vector<Given> samples;
  int breaks = 0;
  int forgotten = 0;
  Duration period{0};
  void sample(Instant t, double mV, bool made_up) { samples.push_back({t, mV, made_up}); }
  void break_off() { ++breaks; }
  void forget() { ++forgotten; }
  void rate(Duration of) { period = of; }
};

struct EcgLineTest : testing::Test {
  EcgLine line;
  Sink sink;
  Instant t{milliseconds(1)};

  float wave() const { return static_cast<float>(std::sin(to_seconds(t.time_since_epoch()) * 9.0)); }
  void hear(Duration length, float mV) {
    for (const Instant until = t + length; t < until; t += kPeriod) line.push(t, mV, sink);
  }
  void hear(Duration length) {
    for (const Instant until = t + length; t < until; t += kPeriod) line.push(t, wave(), sink);
  }
};

TEST_F(EcgLineTest, LearnsThePeriodAndGivesWhatToldIt) {
  hear(milliseconds(200));
  EXPECT_EQ(sink.period, kPeriod);
  ASSERT_EQ(sink.samples.size(), 100U);
  EXPECT_EQ(sink.samples.front().t, Instant(milliseconds(1)));
  EXPECT_EQ(sink.breaks, 0);
}

TEST_F(EcgLineTest, AShortGapIsFilledInByAStraightLine) {
  hear(milliseconds(200), 1.0F);
  const std::size_t before = sink.samples.size();
  t += milliseconds(18);
  line.push(t, 2.0F, sink);
  ASSERT_EQ(sink.samples.size(), before + 10);
  EXPECT_TRUE(sink.samples[before + 4].made_up);
  EXPECT_NEAR(sink.samples[before + 4].mV, 1.5, 1e-6);
  EXPECT_FALSE(sink.samples.back().made_up);
  EXPECT_EQ(sink.breaks, 0);
}

TEST_F(EcgLineTest, ALongGapBreaksTheLineOff) {
  hear(milliseconds(200));
  t += milliseconds(40);
  hear(milliseconds(10));
  EXPECT_EQ(sink.breaks, 1);
  EXPECT_EQ(line.interruptions(), 1U);
  EXPECT_EQ(sink.forgotten, 0);
  EXPECT_FALSE(line.interrupted());
}

TEST_F(EcgLineTest, ValuesThatAreNoneAreAGap) {
  hear(milliseconds(200));
  hear(milliseconds(20), std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(line.interrupted());
  hear(milliseconds(20), std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(line.interrupted());
  EXPECT_EQ(line.interruption(), EcgSignal::kLeadOff);
}

TEST_F(EcgLineTest, AValueThatStandsStillForASecondIsAFlatLine) {
  hear(milliseconds(200));
  hear(milliseconds(980), 0.7F);
  EXPECT_FALSE(line.interrupted());
  hear(milliseconds(40), 0.7F);
  EXPECT_TRUE(line.interrupted());
  EXPECT_EQ(line.interruption(), EcgSignal::kFlat);
}

TEST_F(EcgLineTest, LastBitsOfAnAmplifierAtItsLimitAreFlatByTheBeatsMeasure) {
  hear(milliseconds(200));
  line.set_excursions(2.0);
  for (int i = 0; i < 1300; ++i, t += kPeriod) line.push(t, 5.0F + (i % 2 == 0 ? 0.0F : 0.03F), sink);
  EXPECT_TRUE(line.interrupted());
  EXPECT_EQ(line.interruption(), EcgSignal::kFlat);
}

// A beat that comes out of a flat line is to be seen to rise: the filters begin before it.
TEST_F(EcgLineTest, TheLastOfAFlatLineIsGivenWhenItIsLeft) {
  hear(milliseconds(200));
  hear(milliseconds(1500), 0.7F);
  sink.samples.clear();
  hear(milliseconds(2), 1.5F);
  ASSERT_EQ(sink.samples.size(), 101U);
  EXPECT_TRUE(sink.samples.front().made_up);
  EXPECT_NEAR(sink.samples.front().mV, 0.7, 1e-6);
  EXPECT_EQ(sink.samples[99].t + kPeriod, sink.samples[100].t);
  EXPECT_FALSE(sink.samples.back().made_up);
}

TEST_F(EcgLineTest, AfterHalfAMinuteAllIsOfAnotherSignal) {
  hear(milliseconds(200));
  line.lead_off(t, sink);
  t += std::chrono::seconds(31);
  hear(milliseconds(200));
  EXPECT_EQ(sink.forgotten, 1);
}

// The last value before a gap was heard at t - period: so a gap of `length` is one from there.
TEST_F(EcgLineTest, AGapIsBridgedWhileNoBeatCanHideInIt) {
  hear(milliseconds(200));
  t += milliseconds(26) - kPeriod;
  hear(milliseconds(100));
  EXPECT_EQ(sink.breaks, 0);
  t += milliseconds(34) - kPeriod;
  hear(milliseconds(100));
  EXPECT_EQ(sink.breaks, 1);
}

TEST_F(EcgLineTest, AStampThatIsRoundedHidesNoSampleAndALaterOneDoes) {
  hear(milliseconds(200));
  const std::size_t before = sink.samples.size();
  t += std::chrono::microseconds(1300);
  hear(kPeriod);
  EXPECT_EQ(sink.samples.size(), before + 1);
  t += std::chrono::microseconds(1800);
  hear(kPeriod);
  EXPECT_EQ(sink.samples.size(), before + 3);
}

TEST_F(EcgLineTest, WhatMovesByMoreThanTheLastBitsIsNotFlat) {
  hear(milliseconds(200));
  line.set_excursions(2.0);
  for (int i = 0; i < 1500; ++i, t += kPeriod) line.push(t, 5.0F + (i % 2 == 0 ? 0.0F : 0.07F), sink);
  EXPECT_FALSE(line.interrupted());
  for (int i = 0; i < 1500; ++i, t += kPeriod) line.push(t, 5.0F + (i % 2 == 0 ? 0.0F : 0.05F), sink);
  EXPECT_TRUE(line.interrupted());
}

TEST_F(EcgLineTest, ADiastoleOfASlowHeartIsNotFlat) {
  hear(milliseconds(200));
  line.set_excursions(2.0);
  const auto last_bits = [&](int samples) {
    for (int i = 0; i < samples; ++i, t += kPeriod) line.push(t, 5.0F + (i % 2 == 0 ? 0.0F : 0.03F), sink);
  };
  last_bits(1150);
  EXPECT_FALSE(line.interrupted());
  last_bits(200);
  EXPECT_TRUE(line.interrupted());
}

TEST_F(EcgLineTest, WhatWasLearntOutlivesAnInterruptionOfLessThanHalfAMinute) {
  hear(milliseconds(200));
  line.lead_off(t, sink);
  t += std::chrono::seconds(26);
  hear(milliseconds(200));
  EXPECT_EQ(sink.forgotten, 0);
  line.lead_off(t, sink);
  t += std::chrono::seconds(34);
  hear(milliseconds(200));
  EXPECT_EQ(sink.forgotten, 1);
}

}  // namespace
}  // namespace perimap
