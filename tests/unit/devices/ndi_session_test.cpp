// Sessions with an NDI tracker.
#include "ndi_theatre.hpp"

namespace perimap {
namespace {

TEST(NdiSession, GivesEveryFrameOnceWithItsInstantByBx2BxAndTx) {
  using Newest = NdiEmulatorSettings::Newest;
  for (const Newest newest : {Newest::kBx2, Newest::kBx, Newest::kTx}) {
    SCOPED_TRACE(static_cast<int>(newest));
    Theatre theatre(wired(), {.newest = newest, .wired_tools = 1});
    theatre.run(seconds(5));
    ASSERT_EQ(theatre.host.failure, "");
    EXPECT_EQ(theatre.health.state(), DeviceState::kStreaming);
    EXPECT_THAT(theatre.health.identity(), HasSubstr("emulated"));
    ASSERT_GT(theatre.samples.size(), 450U);
    for (std::size_t i = 0; i < theatre.samples.size(); ++i) {
      const TrackerSample& sample = theatre.samples[i];
      ASSERT_EQ(sample.state, ToolState::kOk);
      const Pose expected = swaying_at(sample.device_frame);
      ASSERT_LT((sample.X_WS.t - expected.t).norm(), newest == Newest::kTx ? 0.02 : 1e-3);
      ASSERT_LT((sample.X_WS.R - expected.R).norm(), 3e-4);
      ASSERT_EQ(sample.device_frame, theatre.samples[0].device_frame + i);
      ASSERT_LE(sample.source_time, sample.arrival);
      if (i > 200) {
        const Instant measured = kStart + sample.device_frame * milliseconds(10);
        ASSERT_LT(std::abs(to_seconds(sample.source_time - measured)), 3e-3);
      }
    }
  }
}

// Over the end of 32 bits; the first frame behind it comes late, which tells a clock that has begun anew.
TEST(NdiSession, TheFrameNumbersEndIsNoGapAndNoNewBeginningOfTheClock) {
  const Instant end = kStart + seconds(3);
  Theatre theatre(wired(), {.wired_tools = 1}, false, {}, 0, PoseTrack::swaying(end, 100.0));
  theatre.run(end - milliseconds(5) - theatre.now);
  theatre.now += milliseconds(12);
  theatre.run(seconds(2));
  ASSERT_EQ(theatre.host.failure, "");
  EXPECT_EQ(theatre.health.lost.get(), 0U);
  ASSERT_GT(theatre.samples.size(), 450U);
  EXPECT_GT(theatre.samples[0].device_frame, 0xFFFFFE00U);
  EXPECT_LT(theatre.samples.back().device_frame, 500U);
  for (std::size_t i = 1; i < theatre.samples.size(); ++i) {
    const TrackerSample& sample = theatre.samples[i];
    ASSERT_EQ(sample.device_frame, theatre.samples[i - 1].device_frame + 1);
    ASSERT_GT(sample.source_time, theatre.samples[i - 1].source_time);
    const Instant measured = end + static_cast<std::int32_t>(sample.device_frame) * milliseconds(10);
    if (i < 100) continue;
    ASSERT_LT(std::abs(to_seconds(sample.source_time - measured)), 4e-3) << sample.device_frame;
  }
}

TEST(NdiSession, OverASerialLineItSendsABreakAndChangesTheRate) {
  Theatre theatre(wired(), {.wired_tools = 1}, true);
  const auto reset = bytes_of("RESETBE6F\r");
  theatre.session.on_bytes(theatre.host, reset, theatre.now);
  theatre.run(seconds(1));
  EXPECT_EQ(theatre.host.breaks, 1);
  EXPECT_THAT(theatre.host.rates, ::testing::ElementsAre(115200));
  EXPECT_THAT(theatre.sent, ::testing::StartsWith("INIT:E3A5\rCOMM:500000048\r"));
  EXPECT_GT(theatre.samples.size(), 50U);
}

// An adapter that sends no break, and a device that was left at the rate of the session before.
TEST(NdiSession, WithoutABreakItFindsTheRateThatTheLastSessionLeft) {
  Theatre theatre(wired(), {.wired_tools = 1}, true, {}, 9600);
  theatre.run(seconds(4));
  ASSERT_EQ(theatre.host.failure, "");
  EXPECT_THAT(theatre.host.rates, ::testing::ElementsAre(115200));
  const std::size_t before = theatre.samples.size();
  EXPECT_GT(before, 100U);
  theatre.host.set_line_rate(9600);
  theatre.session.on_open(theatre.host, theatre.now);
  theatre.run(seconds(6));
  EXPECT_EQ(theatre.host.failure, "");
  EXPECT_GT(theatre.samples.size(), before + 100);
}

TEST(NdiSession, ASilentLineIsTriedAtBothRatesAndThenGivenUp) {
  DeviceHealth health;
  NdiSession session(
      wired(), [](const TrackerSample&) { FAIL(); }, health);
  ScriptedLink link(true);
  session.on_open(link, kStart);
  while (link.failure.empty() && session.next_time() < kStart + seconds(10)) {
    session.on_time(link, session.next_time());
  }
  EXPECT_THAT(link.failure, HasSubstr("no answer at 9600 nor at 115200 baud"));
  EXPECT_LT(session.next_time(), kStart + seconds(5));
}

// A reply of some 90 bytes takes 8 ms at this rate.
TEST(NdiSession, WhatAReplyTakesOnTheLineIsNoPartOfItsInstant) {
  for (const auto newest : {NdiEmulatorSettings::Newest::kBx2, NdiEmulatorSettings::Newest::kTx}) {
    Theatre theatre(wired(), {.newest = newest, .wired_tools = 1}, true, {}, 9600);
    const auto reset = bytes_of("RESETBE6F\r");
    theatre.session.on_bytes(theatre.host, reset, theatre.now);
    theatre.run(seconds(4));
    ASSERT_EQ(theatre.host.failure, "");
    ASSERT_GT(theatre.samples.size(), 200U);
    std::vector<double> late_ms;
    for (std::size_t i = theatre.samples.size() / 2; i < theatre.samples.size(); ++i) {
      const TrackerSample& sample = theatre.samples[i];
      const Instant measured = kStart + sample.device_frame * milliseconds(10);
      late_ms.push_back(to_seconds(sample.source_time - measured) * 1e3);
      EXPECT_GT(sample.arrival - sample.source_time, milliseconds(4));
    }
    std::nth_element(late_ms.begin(), late_ms.begin() + static_cast<std::ptrdiff_t>(late_ms.size() / 2), late_ms.end());
    // The test's clock goes by milliseconds, and a frame is seen when it is asked for.
    EXPECT_NEAR(late_ms[late_ms.size() / 2], 0.0, 3.0);
  }
}

TEST(NdiSession, ADisabledReferenceIsDisabledAndNotMissing) {
  NdiSettings settings = wired();
  settings.sensor.handle = 0x0A;
  settings.reference = NdiTool{{}, 0x0B};
  Theatre theatre(settings, {.newest = NdiEmulatorSettings::Newest::kBx, .wired_tools = 2});
  theatre.run(milliseconds(200));
  ASSERT_FALSE(theatre.samples.empty());
  EXPECT_EQ(theatre.samples.back().state, ToolState::kMissing);
  theatre.device.unplug(0x0B);
  theatre.run(milliseconds(200));
  EXPECT_EQ(theatre.samples.back().state, ToolState::kDisabled);
}

TEST(NdiSession, AnUnpluggedSensorOpensTheLinkAnew) {
  NdiSettings settings = wired();
  settings.sensor.handle = 0x0A;
  Theatre theatre(settings, {.newest = NdiEmulatorSettings::Newest::kBx, .wired_tools = 2});
  theatre.run(milliseconds(500));
  theatre.device.unplug(0x0A);
  theatre.run(seconds(3));
  EXPECT_THAT(theatre.host.failure, HasSubstr("the sensor's tool has been disabled for 2 s"));
}

TEST(NdiSession, AReferencePluggedInAgainIsInitialisedAgain) {
  using Newest = NdiEmulatorSettings::Newest;
  for (const Newest newest : {Newest::kBx2, Newest::kBx, Newest::kTx}) {
    NdiSettings settings = wired();
    settings.sensor.handle = 0x0A;
    settings.reference = NdiTool{{}, 0x0B};
    Theatre theatre(settings, {.newest = newest, .wired_tools = 2, .reference = Pose{}});
    theatre.run(milliseconds(500));
    ASSERT_FALSE(theatre.samples.empty());
    EXPECT_EQ(theatre.samples.back().state, ToolState::kOk);
    theatre.device.unplug(0x0B);
    theatre.device.plug_in(0x0B);
    theatre.run(seconds(1));
    EXPECT_EQ(theatre.samples.back().state, ToolState::kDisabled);
    theatre.run(seconds(2));
    EXPECT_THAT(theatre.host.failure, HasSubstr("no reading of the reference tool for 2 s, or it is disabled"));
    theatre.host.failure.clear();
    theatre.session.on_open(theatre.host, theatre.now);
    theatre.run(seconds(1));
    EXPECT_EQ(theatre.samples.back().state, ToolState::kOk);
  }
}

TEST(NdiSession, AReferenceInAFrameOfItsOwnCountsWhileItIsNear) {
  NdiSettings settings = wired();
  settings.sensor.handle = 0x0A;
  settings.reference = NdiTool{{}, 0x0B};
  for (const bool near : {true, false}) {
    settings.frame_rate_hz = near ? 100.0 : 10.0;  // 50 ms are five frames or none
    Theatre theatre(settings, {.wired_tools = 2, .reference = Pose{}, .frame_a_tool = true});
    theatre.run(seconds(1));
    ASSERT_EQ(theatre.host.failure, "");
    ASSERT_FALSE(theatre.samples.empty());
    for (const TrackerSample& sample : theatre.samples) {
      EXPECT_EQ(sample.state, near ? ToolState::kOk : ToolState::kMissing);
    }
  }
}

TEST(NdiSession, UploadsToolDefinitionsAndMeasuresRelativeToTheReference) {
  NdiSettings settings = wired();
  for (unsigned i = 0; i < 1000; ++i) settings.sensor.definition.push_back(static_cast<std::byte>(i * 7));
  settings.reference = NdiTool{std::vector<std::byte>(128, std::byte{0x55}), std::nullopt};
  settings.world.X_IW = {so3_exp(Vector3d(0, 0, 0.5)), Vector3d(1, 2, 3)};
  const Pose X_TR{so3_exp(Vector3d(0.3, -0.2, 0.1)), Vector3d(100, 0, -600)};
  Theatre theatre(settings, {.reference = X_TR});
  theatre.run(seconds(1));
  ASSERT_EQ(theatre.host.failure, "");
  // Whole blocks of 64 bytes, the last filled with zeros.
  ASSERT_EQ(theatre.device.definition(1).size(), 1024U);
  EXPECT_TRUE(std::equal(settings.sensor.definition.begin(), settings.sensor.definition.end(),
                         theatre.device.definition(1).begin()));
  EXPECT_EQ(theatre.device.definition(2), settings.reference->definition);
  ASSERT_FALSE(theatre.samples.empty());
  const TrackerSample& sample = theatre.samples.back();
  const Pose expected = settings.world.X_IW * (X_TR.inverse() * swaying_at(sample.device_frame));
  EXPECT_LT((sample.X_WS.t - expected.t).norm(), 1e-3);
}

TEST(NdiSession, AToolIsNotItsOwnReference) {
  NdiSettings settings = wired();
  settings.sensor.handle = 0x0A;
  settings.reference = NdiTool{{}, 0x0A};
  Theatre theatre(settings, {.wired_tools = 2, .reference = Pose{}});
  theatre.run(seconds(1));
  EXPECT_THAT(theatre.host.failure, HasSubstr("sensor and reference are both the tool of port handle 0A"));
  EXPECT_TRUE(theatre.samples.empty());
}

TEST(NdiSession, WithoutANameTheOneToolBesideTheReferenceIsTheSensor) {
  for (const std::uint16_t reference : {std::uint16_t{0x0A}, std::uint16_t{0x0B}}) {
    const Pose X_TR{so3_exp(Vector3d(0.3, -0.2, 0.1)), Vector3d(100, 0, -600)};
    NdiSettings settings = wired();
    settings.reference = NdiTool{{}, reference};
    Theatre theatre(settings, {.wired_tools = 2, .reference = X_TR});
    theatre.run(seconds(1));
    ASSERT_EQ(theatre.host.failure, "");
    ASSERT_FALSE(theatre.samples.empty());
    const TrackerSample& sample = theatre.samples.back();
    const Pose moving = swaying_at(sample.device_frame);
    const Pose expected = reference == 0x0B ? X_TR.inverse() * moving : moving.inverse() * X_TR;
    EXPECT_EQ(sample.state, ToolState::kOk);
    EXPECT_LT((sample.X_WS.t - expected.t).norm(), 1e-3);
  }
}

// What the session says against these tools; "" when it would track.
std::string start_with(NdiSession& session, const std::string& handles_and_states) {
  ScriptedLink link;
  Instant now = kStart;
  session.on_open(link, now);
  while (link.failure.empty()) {
    const std::string command = link.take_sent();
    if (command.starts_with("TSTART")) return "";
    if (command.empty()) {
      now = session.next_time();
      session.on_time(link, now);
      continue;
    }
    const bool enabled = command.starts_with("PHSR:03");
    const std::string reply = ndi_with_crc(enabled ? handles_and_states : command.starts_with("PHSR") ? "00" : "OKAY");
    session.on_bytes(link, bytes_of(reply), now);
  }
  return link.failure;
}

TEST(NdiSession, WithoutANameAnotherToolDoesNotTakeTheSensorsPlace) {
  DeviceHealth health;
  NdiSettings settings = wired();
  settings.reference = NdiTool{{}, 0x0B};
  NdiSession session(
      settings, [](const TrackerSample&) {}, health);
  EXPECT_EQ(start_with(session, "020A0010B001"), "");
  EXPECT_THAT(start_with(session, "020B0010C001"), HasSubstr("0C is there, and 0A was the sensor"));
  EXPECT_EQ(start_with(session, "020A0010B001"), "") << "it is plugged in again";
}

TEST(NdiSession, WithoutAValidReferenceThereIsNoPose) {
  NdiSettings settings = wired();
  settings.sensor.handle = 0x0A;
  settings.reference = NdiTool{{}, 0x0B};
  Theatre theatre(settings, {.wired_tools = 2});  // the second tool is nowhere
  theatre.run(seconds(1));
  ASSERT_FALSE(theatre.samples.empty());
  for (const TrackerSample& sample : theatre.samples) EXPECT_EQ(sample.state, ToolState::kMissing);
}

}  // namespace
}  // namespace perimap
