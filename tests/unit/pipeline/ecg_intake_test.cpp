#include "core/pipeline/ecg_intake.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(2);
constexpr int kBlock = 10;
constexpr Duration kCycle = milliseconds(800);

// One QRS complex each 0.8 s, at 0.4, 1.2, ... s, with a noise of some 0.1 uV, so that no stretch comes twice.
float lead_mV(Instant t) {
  const double x = std::remainder(to_seconds(t.time_since_epoch()) - 0.4, 0.8) / 0.012;
  const auto number = static_cast<std::uint64_t>(t.time_since_epoch() / kPeriod);
  const std::uint64_t drawn = (number + 1) * 0x9E3779B97F4A7C15ULL >> 40U;
  return static_cast<float>(std::exp(-0.5 * x * x) + 1e-4 * static_cast<double>(drawn) / 16777216.0);
}

struct Intake : ::testing::Test {
  std::unique_ptr<EcgClockCells> cells = std::make_unique<EcgClockCells>();
  std::unique_ptr<PipelineCounters> counters = std::make_unique<PipelineCounters>();
  std::unique_ptr<EcgIntake> intake = std::make_unique<EcgIntake>(EcgIntakeSettings{}, *cells, *counters);
  Instant t{milliseconds(0)};
  std::uint32_t sequence = 0;

  // Blocks until `until`; fill(block, i, t) says what its sample i of that time is.
  template <class Fill>
  void send(Instant until, Fill&& fill) {
    while (t < until) {
      EcgBlock block;
      block.device_sequence = sequence;
      sequence += kBlock;
      block.sample_period = kPeriod;
      block.first_sample_time = t;
      block.count = kBlock;
      for (std::size_t i = 0; i < kBlock; ++i) {
        fill(block, i, t);
        t += kPeriod;
      }
      block.arrival = t;
      intake->push(block);
    }
  }
  // Of one lead, each sample's value by its time.
  template <class Value>
  void hear(Instant until, Value&& value) {
    send(until, [&](EcgBlock& block, std::size_t i, Instant at) { block.mV[i] = value(at); });
  }
  const CardiacClock& clock() {
    static_cast<void>(cells->mapper.update());
    return cells->mapper.front();
  }
  // What the leads are good for, as it is told; of one that is not there nothing.
  using Signals = std::array<std::optional<EcgSignal>, 2>;
  [[nodiscard]] Signals signals() const {
    Signals told;
    for (std::size_t i = 0; i < told.size(); ++i) {
      const std::uint64_t counted = counters->ecg_leads[i].get();
      if (counted > 0) told[i] = static_cast<EcgSignal>(counted - 1);
    }
    return told;
  }
  // The running cycle is no guide to others once it has ended.
  bool cycle_taught(Instant in_it) { return clock().at(in_it).teaches; }
};

constexpr Instant kMidCycle{milliseconds(20'000)};  // 0.4 s after a beat

TEST_F(Intake, OneOfTwoLeadsIsEnough) {
  const auto blocks_until = [&](Instant until, bool first_off, bool second_off) {
    send(until, [&](EcgBlock& block, std::size_t i, Instant at) {
      block.lead_off = first_off;
      block.has_second = true;
      block.second_off = second_off;
      block.mV[i] = lead_mV(at);
      block.second_mV[i] = -0.5F * lead_mV(at);
    });
  };
  blocks_until(kMidCycle, false, false);
  ASSERT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked);
  EXPECT_EQ(signals(), (Signals{EcgSignal::kGood, EcgSignal::kGood}));
  blocks_until(kMidCycle + milliseconds(8000), true, false);
  EXPECT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked);
  EXPECT_EQ(signals(), (Signals{EcgSignal::kLeadOff, EcgSignal::kGood})) << "which of them is off is told";
  EXPECT_TRUE(cycle_taught(kMidCycle + milliseconds(4000)));
  blocks_until(kMidCycle + milliseconds(16000), false, true);
  EXPECT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked);
  EXPECT_EQ(signals(), (Signals{EcgSignal::kGood, EcgSignal::kLeadOff}));
  EXPECT_EQ(counters->ecg_lead_off.get(), 0U);
  blocks_until(kMidCycle + milliseconds(18000), true, true);
  EXPECT_EQ(clock().as_of(t).at(t).state, PhaseState::kFreeRunning);
  EXPECT_EQ(counters->ecg_lead_off.get(), 1000U);
}

TEST_F(Intake, ASecondLeadThatIsOffFromTheStartIsTold) {
  send(kMidCycle, [&](EcgBlock& block, std::size_t i, Instant at) {
    block.has_second = true;
    block.second_off = true;
    block.mV[i] = lead_mV(at);
  });
  EXPECT_EQ(signals(), (Signals{EcgSignal::kGood, EcgSignal::kLeadOff}));
}

TEST_F(Intake, ALineThatGoesFlatIsCountedAndSaid) {
  hear(kMidCycle, lead_mV);
  EXPECT_EQ(signals(), (Signals{EcgSignal::kGood, std::nullopt}));
  ASSERT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked);
  const std::uint64_t heard = counters->last_good_ecg_ns.get();
  hear(kMidCycle + milliseconds(1500), [](Instant) { return 4.0F; });
  EXPECT_EQ(clock().as_of(t).at(t).state, PhaseState::kFreeRunning);
  EXPECT_NEAR(static_cast<double>(counters->ecg_lead_off.get()), 300.0, 15.0) << "from 0.9 s on: a beat is overdue";
  EXPECT_LT(counters->last_good_ecg_ns.get(), heard + 1'100'000'000U);
}

TEST_F(Intake, ALeadThatGivesItsLastSecondAgainAndAgainIsSaidToBeRepeatedAndIsNotListenedTo) {
  hear(kMidCycle, lead_mV);
  ASSERT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked);
  const auto last_second = [](Instant at) {
    return lead_mV(kMidCycle - milliseconds(1000) + (at - kMidCycle) % milliseconds(1000));
  };
  hear(kMidCycle + milliseconds(2000), last_second);
  EXPECT_EQ(signals(), (Signals{EcgSignal::kRepeated, std::nullopt}));
  EXPECT_GE(counters->ecg_repeated.get(), 500U);
  hear(kMidCycle + milliseconds(6000), last_second);
  EXPECT_NE(clock().as_of(t).at(t).state, PhaseState::kLocked);
  hear(kMidCycle + milliseconds(16000), lead_mV);
  EXPECT_EQ(signals(), (Signals{EcgSignal::kGood, std::nullopt}));
  EXPECT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked);
}

TEST_F(Intake, ASecondLeadThatIsRepeatedIsCountedToo) {
  const auto last_second = [](Instant at) {
    return at < kMidCycle ? at : kMidCycle - milliseconds(1000) + (at - kMidCycle) % milliseconds(1000);
  };
  send(kMidCycle + milliseconds(2000), [&](EcgBlock& block, std::size_t i, Instant at) {
    block.has_second = true;
    block.mV[i] = lead_mV(at);
    block.second_mV[i] = -0.5F * lead_mV(last_second(at));
  });
  EXPECT_EQ(signals(), (Signals{EcgSignal::kGood, EcgSignal::kRepeated}));
  EXPECT_GE(counters->ecg_repeated.get(), 500U);
  EXPECT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked) << "by the first";
}

TEST_F(Intake, ARecordThatIsPlayedInALoopIsHeardWhereThatWasSaid) {
  EcgIntakeSettings settings;
  settings.may_loop = true;
  intake = std::make_unique<EcgIntake>(settings, *cells, *counters);
  hear(kMidCycle + milliseconds(20'000),
       [](Instant at) { return lead_mV(Instant((at.time_since_epoch()) % (10 * kCycle))); });
  EXPECT_EQ(signals(), (Signals{EcgSignal::kGood, std::nullopt}));
  EXPECT_EQ(counters->ecg_repeated.get(), 0U);
  EXPECT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked);
}

// Of a device that had hung before the crash.
TEST_F(Intake, WhatARunBeforeHeardAgainAndAgainTeachesNoBeats) {
  const auto last_second = [](Instant at) {
    return lead_mV(at < kMidCycle ? at : kMidCycle - milliseconds(1000) + (at - kMidCycle) % milliseconds(1000));
  };
  const auto recall = [&](Instant until) {
    for (; t < until;) {
      EcgBlock block;
      block.sample_period = kPeriod;
      block.first_sample_time = t;
      block.count = kBlock;
      for (std::size_t i = 0; i < kBlock; ++i, t += kPeriod) block.mV[i] = last_second(t);
      intake->recall(block);
    }
  };
  recall(kMidCycle);
  const std::uint64_t beats = clock().beats();
  ASSERT_GT(beats, 15U);
  recall(kMidCycle + milliseconds(20'000));
  EXPECT_LE(clock().beats(), beats + 3) << "before it is known that they are repeated";
  EXPECT_EQ(counters->ecg_repeated.get(), 0U) << "what was heard before is not counted again";
  // And what comes now is known to be that, too.
  hear(t + milliseconds(2000), last_second);
  EXPECT_EQ(signals(), (Signals{EcgSignal::kRepeated, std::nullopt}));
}

TEST_F(Intake, AShortStretchOfMissingSamplesInterruptsNothing) {
  hear(kMidCycle, lead_mV);
  t += milliseconds(20);
  hear(kMidCycle + kCycle + milliseconds(300), lead_mV);
  EXPECT_TRUE(cycle_taught(kMidCycle));
}

TEST_F(Intake, ACycleInWhichABeatMayBeHiddenTeachesNothing) {
  hear(kMidCycle, lead_mV);
  t += milliseconds(60);
  hear(kMidCycle + 2 * kCycle, lead_mV);
  EXPECT_FALSE(cycle_taught(kMidCycle));
  EXPECT_EQ(clock().as_of(t).at(t).state, PhaseState::kLocked);
}

// The last sample of each block is a number.
TEST_F(Intake, SoDoValuesThatAreNoneWithinBlocks) {
  hear(kMidCycle, lead_mV);
  hear(kMidCycle + milliseconds(60), [&](Instant at) {
    const bool told =
        (at + kPeriod - kMidCycle) % (kBlock * kPeriod) == Duration::zero() && at > kMidCycle + milliseconds(50);
    return told ? lead_mV(at) : std::numeric_limits<float>::quiet_NaN();
  });
  hear(kMidCycle + 2 * kCycle, lead_mV);
  EXPECT_FALSE(cycle_taught(kMidCycle));
}

}  // namespace
}  // namespace perimap
