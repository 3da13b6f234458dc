// What emulated devices measure, from records and recordings.
#include "drivers/standins/emulator/sampled_waveform.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const Instant kStart(seconds(100));

EcgBlock ecg_block(Instant first, float from, std::uint32_t count) {
  EcgBlock block;
  block.first_sample_time = first;
  block.sample_period = milliseconds(4);
  block.count = count;
  for (std::uint32_t i = 0; i < count; ++i) block.mV[i] = from + static_cast<float>(i);
  return block;
}

TEST(SampledWaveform, IsInterpolatedAndEndsWithItsLastSample) {
  const SampledWaveform once(kStart, 100.0, {0.0F, 1.0F, 3.0F}, false);
  EXPECT_FALSE(once.at(kStart - Duration(1)));
  EXPECT_EQ(once.at(kStart), 0.0F);
  EXPECT_FLOAT_EQ(*once.at(kStart + milliseconds(5)), 0.5F);
  EXPECT_FLOAT_EQ(*once.at(kStart + milliseconds(15)), 2.0F);
  EXPECT_EQ(once.at(kStart + milliseconds(20)), 3.0F);
  EXPECT_FALSE(once.at(kStart + milliseconds(21)));
}

TEST(SampledWaveform, RepeatedItGoesFromItsEndToItsBeginning) {
  const SampledWaveform repeated(kStart, 100.0, {0.0F, 1.0F, 3.0F}, true);
  for (const int round : {0, 1, 1000}) {
    EXPECT_FLOAT_EQ(*repeated.at(kStart + round * milliseconds(30) + milliseconds(15)), 2.0F);
    EXPECT_FLOAT_EQ(*repeated.at(kStart + round * milliseconds(30) + milliseconds(25)), 1.5F);
  }
}

TEST(SampledWaveform, WhatARecordingMissesIsAsIfTheElectrodeWereOffAndNothingComesEarlier) {
  EcgBlock off = ecg_block(kStart + milliseconds(400), 0.0F, 10);
  off.lead_off = true;
  const std::vector<EcgBlock> blocks{ecg_block(kStart, 0.0F, 25), ecg_block(kStart + milliseconds(100), 25.0F, 25),
                                     ecg_block(kStart + milliseconds(300), 75.0F, 25), off};
  const SampledWaveform played(blocks, seconds(5));
  const Instant start = kStart + seconds(5);
  EXPECT_EQ(played.start(), start);
  for (const int ms : {0, 50, 98, 150, 196, 300, 350}) {
    ASSERT_TRUE(played.at(start + milliseconds(ms)));
    EXPECT_FLOAT_EQ(*played.at(start + milliseconds(ms)), static_cast<float>(ms) / 4.0F) << ms;
  }
  for (const int ms : {200, 250, 410}) EXPECT_TRUE(std::isnan(*played.at(start + milliseconds(ms)))) << ms;
  EXPECT_FALSE(played.at(start + milliseconds(500)));
}

TEST(SampledWaveform, RespirationOfAnyUnitGoesFromMinusOneToOne) {
  RespirationBlock block;
  block.first_sample_time = kStart;
  block.sample_period = milliseconds(8);
  block.count = 4;
  block.values = {300.0F, 320.0F, 340.0F, std::nanf("")};
  RespirationBlock off = block;
  off.first_sample_time += milliseconds(32);
  off.sensor_off = true;
  off.values = {5000.0F, 5000.0F, 5000.0F, 5000.0F};
  const SampledWaveform played(std::vector{block, off}, Duration(0));
  EXPECT_FLOAT_EQ(*played.at(kStart), -1.0F);
  EXPECT_FLOAT_EQ(*played.at(kStart + milliseconds(8)), 0.0F);
  EXPECT_FLOAT_EQ(*played.at(kStart + milliseconds(16)), 1.0F);
  EXPECT_TRUE(std::isnan(*played.at(kStart + milliseconds(24))));
  EXPECT_TRUE(std::isnan(*played.at(kStart + milliseconds(40))));
}

TEST(SampledWaveform, ABreathTakesItsPeriod) {
  const SampledWaveform breathing = SampledWaveform::breathing(seconds(4), kStart);
  for (const int breath : {0, 1, 50}) {
    const Instant begin = kStart + breath * seconds(4);
    EXPECT_NEAR(*breathing.at(begin), -1.0F, 1e-4);
    EXPECT_NEAR(*breathing.at(begin + seconds(2)), 1.0F, 1e-4);
    EXPECT_LT(*breathing.at(begin + seconds(1)), 0.0F) << "most of the time near its end";
  }
}

}  // namespace
}  // namespace perimap
