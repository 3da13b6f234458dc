#include "core/pipeline/sensor_entrance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr int kWidth = 32;
constexpr int kHeight = 24;

struct Entrance : ::testing::Test {
  PipelineCounters counters;
  std::unique_ptr<SensorEntrance> entrance =
      std::make_unique<SensorEntrance>(kWidth, kHeight, EcgIntakeSettings{}, BreathDetectorSettings{}, counters);
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(40 * kHeight, 7);
  GreyImage image{pixels.data(), kWidth, kHeight, 40};

  static FrameStamp stamp(std::uint64_t sequence) {
    const Instant capture(milliseconds(1000 + 33 * static_cast<int>(sequence)));
    return {sequence, capture, capture + milliseconds(12)};
  }
};

TEST_F(Entrance, CopiesTheRowsOfAPaddedImage) {
  pixels[40 * 3 + 5] = 99;
  ASSERT_TRUE(entrance->push_frame(stamp(0), image));
  FrameHandle frame;
  ASSERT_TRUE(entrance->pop_frame(frame));
  EXPECT_EQ(entrance->image(frame).row(3)[5], 99);
  EXPECT_EQ(entrance->image(frame).row(4)[5], 7);
}

TEST_F(Entrance, CarriesAFramesColourIfItIsReducedAsAgreed) {
  constexpr int kColourWidth = reduced_side(kWidth), kColourHeight = reduced_side(kHeight),
                kStride = 3 * kColourWidth + 5;
  std::vector<std::uint8_t> bgr(kStride * kColourHeight, 1);
  bgr[2 * kStride + 4] = 77;
  FrameHandle frame;
  ASSERT_TRUE(entrance->push_frame(stamp(0), image, {bgr.data(), kColourWidth, kColourHeight, kStride}));
  ASSERT_TRUE(entrance->pop_frame(frame));
  const ColourImage colour = entrance->colour(frame);
  ASSERT_NE(colour.bgr, nullptr);
  EXPECT_EQ(colour.width, kColourWidth);
  EXPECT_EQ(colour.height, kColourHeight);
  EXPECT_EQ(colour.row(2)[4], 77);
  EXPECT_EQ(colour.row(2)[5], 1);
  // In the same buffer, after the one with colour.
  for (const ColourImage& none : {ColourImage{}, ColourImage{bgr.data(), kColourWidth, kColourHeight - 1, kStride}}) {
    entrance->give_back(frame);
    ASSERT_TRUE(entrance->push_frame(stamp(1), image, none));
    ASSERT_TRUE(entrance->pop_frame(frame));
    EXPECT_EQ(entrance->colour(frame).bgr, nullptr);
    EXPECT_EQ(entrance->image(frame).row(3)[5], 7);
  }
}

TEST_F(Entrance, KeepsAMinutesStampsForAPublisherThatIsHeldUp) {
  for (std::uint64_t i = 0; i < 3600; ++i) static_cast<void>(entrance->push_frame(stamp(i), image));
  FrameStamp told;
  for (std::uint64_t i = 0; i < 3600; ++i) {
    ASSERT_TRUE(entrance->pop_stamp(told));
    ASSERT_EQ(told.sequence, i);
  }
}

TEST_F(Entrance, AFrameWhoseStampsFindNoPlaceIsMappedAndCountedOnce) {
  std::uint64_t pushed = 0;
  FrameHandle frame;
  while (counters.frames_dropped.get() < 3 && pushed < 100'000) {
    ASSERT_TRUE(entrance->push_frame(stamp(pushed++), image));
    ASSERT_TRUE(entrance->pop_frame(frame));
    entrance->give_back(frame);
  }
  // Neither finds a place.
  while (entrance->push_frame(stamp(pushed++), image)) {
  }
  std::uint64_t told = 0;
  FrameStamp announced;
  while (entrance->pop_stamp(announced)) ++told;
  EXPECT_EQ(told + counters.frames_dropped.get(), pushed);
}

TEST_F(Entrance, DropsAndCountsWhenTheMapperGivesNoBufferBackButStillAnnouncesTheFrame) {
  int taken = 0;
  for (std::uint64_t i = 0; i < 20; ++i) taken += entrance->push_frame(stamp(i), image) ? 1 : 0;
  EXPECT_LT(taken, 20);
  EXPECT_EQ(counters.frames_dropped.get(), static_cast<std::uint64_t>(20 - taken));
  FrameStamp announced;
  int stamps = 0;
  while (entrance->pop_stamp(announced)) ++stamps;
  EXPECT_EQ(stamps, 20);
}

TEST_F(Entrance, KeepsAQuarterOfASecondForAMapperThatIsHeldUpAtAnyFrameRate) {
  for (const double rate_per_s : {15.0, 30.0, 60.0, 120.0, 240.0}) {
    SCOPED_TRACE(rate_per_s);
    entrance =
        std::make_unique<SensorEntrance>(kWidth, kHeight, EcgIntakeSettings{}, BreathDetectorSettings{}, counters);
    std::uint64_t sequence = 0;
    const auto push = [&] {
      const Instant capture = from_ns(1'000'000'000) + from_seconds(static_cast<double>(sequence) / rate_per_s);
      return entrance->push_frame({sequence++, capture, capture + milliseconds(12)}, image);
    };
    FrameHandle frame;
    for (int i = 0; i < 30; ++i) {
      ASSERT_TRUE(push());
      ASSERT_TRUE(entrance->pop_frame(frame));
      entrance->give_back(frame);
    }
    int waiting = 0;
    while (push()) ++waiting;
    // One of them is the frame that was mapped last.
    EXPECT_NEAR((waiting - 1) / rate_per_s, 0.267, 0.5 / rate_per_s);
  }
}

TEST_F(Entrance, BuffersGivenBackServeAgain) {
  for (std::uint64_t i = 0; i < 100; ++i) {
    ASSERT_TRUE(entrance->push_frame(stamp(i), image));
    FrameHandle frame;
    ASSERT_TRUE(entrance->pop_frame(frame));
    EXPECT_EQ(frame.stamp.sequence, i);
    entrance->give_back(frame);
  }
  EXPECT_EQ(counters.frames_dropped.get(), 0U);
}

TEST_F(Entrance, CountsFramesThatTheDeviceDropped) {
  ASSERT_TRUE(entrance->push_frame(stamp(4), image));
  ASSERT_TRUE(entrance->push_frame(stamp(8), image));
  EXPECT_EQ(counters.frames_dropped.get(), 3U);
}

TEST_F(Entrance, RefusesAFrameOfAnotherSize) {
  EXPECT_FALSE(entrance->push_frame(stamp(0), GreyImage{pixels.data(), kWidth - 1, kHeight, 40}));
  EXPECT_EQ(counters.frames_dropped.get(), 1U);
}

TEST_F(Entrance, CountsInvalidPosesAndKeepsThem) {
  TrackerSample sample;
  sample.source_time = sample.arrival = from_ns(1'000'000);
  sample.state = ToolState::kMissing;
  entrance->push_pose(sample);
  EXPECT_EQ(counters.poses_invalid.get(), 1U);
  EXPECT_EQ(counters.last_pose_ns.get(), 1'000'000U);
  EXPECT_EQ(counters.last_good_pose_ns.get(), 0U);
  TrackerSample popped;
  ASSERT_TRUE(entrance->pop_pose(popped));
  EXPECT_EQ(popped.state, ToolState::kMissing);
}

TEST_F(Entrance, TellsHowFarApartTheTrackersReadingsAre) {
  for (int i = 0; i < 10; ++i) {
    TrackerSample sample;
    sample.source_time = Instant(milliseconds(25 * i));
    sample.arrival = sample.source_time + milliseconds(5);
    entrance->push_pose(sample);
  }
  const LatencyHistogram::Summary apart = counters.tracker_interval.summary();
  EXPECT_EQ(apart.count, 9U);
  EXPECT_NEAR(to_seconds(apart.p50), 0.025, 0.002);
}

TEST_F(Entrance, CountsEcgSamplesThatTheDeviceLost) {
  EcgBlock block;
  block.sample_period = milliseconds(4);
  block.count = 4;
  block.device_sequence = 0;
  entrance->push_ecg(block);
  block.device_sequence = 10;
  entrance->push_ecg(block);
  EXPECT_EQ(counters.ecg_dropped.get(), 6U);
  EXPECT_EQ(counters.ecg_samples.get(), 8U);
}

TEST_F(Entrance, LeadOffSamplesReachTheCountersAndNotTheClock) {
  EcgBlock block;
  block.sample_period = milliseconds(4);
  block.count = 4;
  block.lead_off = true;
  entrance->push_ecg(block);
  EXPECT_EQ(counters.ecg_lead_off.get(), 4U);
  ASSERT_TRUE(entrance->ecg_clocks().mapper.update());
  EXPECT_EQ(entrance->ecg_clocks().mapper.front().beats(), 0U);
}

TEST_F(Entrance, PulsesOfATriggerLineReplaceTheDetector) {
  EcgIntakeSettings settings;
  settings.r_trigger = RTriggerSettings{};
  settings.r_trigger->delay = milliseconds(30);
  const auto triggered =
      std::make_unique<SensorEntrance>(kWidth, kHeight, settings, BreathDetectorSettings{}, counters);
  const Instant first(milliseconds(5030));
  for (std::uint32_t i = 0; i < 20; ++i) {
    if (i == 7) continue;  // lost on the way
    const Instant edge = first + i * milliseconds(800);
    triggered->push_r_trigger({edge, edge + milliseconds(1), i});
    entrance->push_r_trigger({edge, edge + milliseconds(1), i});
  }
  ASSERT_TRUE(triggered->ecg_clocks().mapper.update());
  const CardiacClock& clock = triggered->ecg_clocks().mapper.front();
  EXPECT_EQ(clock.beats(), 19U);
  EXPECT_EQ(clock.anchor(), first + 19 * milliseconds(800) - milliseconds(30));
  EXPECT_EQ(counters.r_triggers.get(), 38U);
  EXPECT_EQ(counters.r_triggers_dropped.get(), 2U);
  EXPECT_FALSE(entrance->ecg_clocks().mapper.update()) << "without a trigger configured pulses are only counted";
}

// Half a second of breaths of 4 s.
RespirationBlock breathing_block(int k) {
  RespirationBlock block;
  block.sample_period = std::chrono::milliseconds(10);
  block.count = 50;
  block.first_sample_time = from_ns(0) + k * 50 * block.sample_period;
  for (std::size_t i = 0; i < block.count; ++i) {
    const double t = to_seconds(block.first_sample_time.time_since_epoch()) + 0.01 * static_cast<double>(i);
    block.values[i] = static_cast<float>(-std::cos(2.0 * 3.14159265 * t / 4.0));
  }
  return block;
}

TEST_F(Entrance, NothingIsLeftOfTheOldPatientsBreaths) {
  for (int k = 0; k < 60; ++k) entrance->push_respiration(breathing_block(k));
  const Instant now = breathing_block(60).first_sample_time;
  ASSERT_TRUE(entrance->breath().known(now));
  entrance->ask_to_forget();
  entrance->push_respiration(breathing_block(60));
  EXPECT_EQ(entrance->breath().onsets, 0U);
  EXPECT_FALSE(entrance->breath().known(now));
  for (int k = 61; k < 121; ++k) entrance->push_respiration(breathing_block(k));
  EXPECT_TRUE(entrance->breath().known(breathing_block(121).first_sample_time)) << "the new one's are heard";
}

TEST_F(Entrance, ARespirationChannelsBreathsAreToldUntilItsSensorIsOff) {
  RespirationBlock block;
  for (int k = 0; k < 60; ++k) {
    block = breathing_block(k);
    entrance->push_respiration(block);
  }
  const Instant now = block.first_sample_time + block.count * block.sample_period;
  EXPECT_TRUE(entrance->breath().known(now));
  EXPECT_NEAR(to_seconds(entrance->breath().period), 4.0, 0.05);
  block.sensor_off = true;
  entrance->push_respiration(block);
  EXPECT_FALSE(entrance->breath().known(now));
}

}  // namespace
}  // namespace perimap
