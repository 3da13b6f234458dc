// Sessions with an NDI tracker in which something is wrong.
#include "ndi_theatre.hpp"

namespace perimap {
namespace {

TEST(NdiSession, AMissingToolIsSaidAndComesBack) {
  EmulatorFaults faults;
  faults.missing_every = seconds(1);
  faults.missing_for = milliseconds(300);
  Theatre theatre(wired(), {.wired_tools = 1}, false, faults);
  theatre.run(seconds(3));
  for (const TrackerSample& sample : theatre.samples) {
    EXPECT_EQ(sample.state == ToolState::kMissing, sample.device_frame % 100 >= 70) << sample.device_frame;
  }
}

TEST(NdiSession, DamagedRepliesGiveNoPoseAndDoNotStopTheStream) {
  EmulatorFaults faults;
  faults.bad_check = 0.03;
  faults.garbled = 0.03;
  faults.truncated = 0.01;
  // The start has to get through some twenty commands; a session that fails is opened anew, as its link would.
  Theatre theatre(wired(), {.wired_tools = 1}, false, faults);
  for (int opened = 0; opened < 50 && theatre.samples.size() < 2000; ++opened) {
    theatre.run(seconds(60));
    theatre.host.failure.clear();
    theatre.device.on_open(theatre.far, theatre.now);
    theatre.session.on_open(theatre.host, theatre.now);
  }
  ASSERT_GT(theatre.samples.size(), 2000U);
  EXPECT_GT(theatre.health.damaged.get(), 50U);
  for (const TrackerSample& sample : theatre.samples) {
    ASSERT_EQ(sample.state, ToolState::kOk);
    ASSERT_LT((sample.X_WS.t - swaying_at(sample.device_frame).t).norm(), 1e-3);
  }
}

// An answering link whose replies in the stream are the test's own.
struct DamagedStream : Theatre {
  DamagedStream() : Theatre(wired(), {.wired_tools = 1}) {
    run(seconds(1));
    EXPECT_EQ(health.state(), DeviceState::kStreaming);
  }
  void damage_for(Duration longest, const std::function<std::vector<std::byte>()>& reply) {
    for (const Instant end = now + longest; now < end && host.failure.empty(); now += milliseconds(1)) {
      const std::string asked = host.take_sent();
      sent += asked;
      const auto bytes = reply();
      if (!bytes.empty()) session.on_bytes(host, bytes, now);
      if (now >= session.next_time()) session.on_time(host, now);
    }
  }
};

TEST(NdiSession, AStreamOfDamagedRepliesIsSilentAndThenOpenedAnewWithAReason) {
  DamagedStream theatre;
  const std::uint64_t before = theatre.health.damaged.get();
  int round = 0;
  // A reply every 50 ms, each with a wrong CRC.
  const auto damaged = [&round] { return ++round % 50 == 0 ? bytes_of("OKAYA897\r") : std::vector<std::byte>(); };
  theatre.damage_for(milliseconds(500), damaged);
  EXPECT_EQ(theatre.health.state(), DeviceState::kSilent);
  EXPECT_EQ(theatre.host.failure, "");
  theatre.damage_for(seconds(3), damaged);
  EXPECT_THAT(theatre.host.failure, HasSubstr("came damaged (the last: text CRC)"));
  EXPECT_GT(theatre.health.damaged.get(), before + 10);
}

TEST(NdiSession, UnbrokenNoiseDoesNotPutOffSilenceAndFailure) {
  DamagedStream theatre;
  std::mt19937 random(3);
  const auto noise = [&random] {
    std::vector<std::byte> bytes(10);
    for (std::byte& b : bytes) b = static_cast<std::byte>(random() % 256);
    return bytes;
  };
  theatre.damage_for(milliseconds(500), noise);
  EXPECT_EQ(theatre.health.state(), DeviceState::kSilent);
  theatre.damage_for(seconds(3), noise);
  EXPECT_THAT(theatre.host.failure, HasSubstr("damaged"));
}

TEST(NdiSession, ABx2ThatIsNeverUnderstoodIsGivenUpForBx) {
  Theatre theatre(wired(), {.wired_tools = 1, .malformed_bx2 = true});
  theatre.run(seconds(1));
  EXPECT_EQ(theatre.host.failure, "");
  EXPECT_GT(theatre.samples.size(), 50U);
  EXPECT_THAT(theatre.sent, HasSubstr("BX:0801"));
}

TEST(NdiSession, AHandleThatShowsAfterTheFirstIsInitialisedIsInitialisedToo) {
  NdiSettings settings = wired();
  settings.sensor.handle = 0x0B;
  Theatre theatre(settings, {.wired_tools = 1, .second_channel = true});
  theatre.run(seconds(1));
  EXPECT_EQ(theatre.host.failure, "");
  EXPECT_GT(theatre.samples.size(), 50U);
}

TEST(NdiSession, ADeviceThatAlwaysFindsAPortToInitialiseDoesNotHoldUpTheStart) {
  DeviceHealth health;
  NdiSession session(
      wired(), [](const TrackerSample&) {}, health);
  ScriptedLink link;
  Instant now = kStart;
  session.on_open(link, now);
  bool started = false;
  for (int i = 0; i < 200 && !started && link.failure.empty(); ++i, now += milliseconds(150)) {
    const std::string asked = link.take_sent();
    started = asked.starts_with("TSTART");
    if (asked.empty()) {
      session.on_time(link, now);
    } else if (asked.starts_with("PHSR:01")) {
      session.on_bytes(link, bytes_of(ndi_with_crc("00")), now);
    } else if (asked.starts_with("PHSR")) {
      session.on_bytes(link, bytes_of(ndi_with_crc("010A001")), now);
    } else {
      session.on_bytes(link, bytes_of(ndi_with_crc("OKAY")), now);
    }
  }
  EXPECT_EQ(link.failure, "");
  EXPECT_TRUE(started);
}

TEST(NdiSession, FramesAtAnotherRateThanConfiguredGiveNoPoseAndAReason) {
  NdiSettings settings = wired();
  settings.frame_rate_hz = 60.0;  // the device has 100
  Theatre theatre(settings, {.wired_tools = 1});
  theatre.run(seconds(8));
  const std::size_t before = theatre.samples.size();
  theatre.run(seconds(10));
  EXPECT_EQ(theatre.samples.size(), before);
  EXPECT_EQ(theatre.host.failure, "");
  EXPECT_EQ(theatre.health.state(), DeviceState::kSilent);
  EXPECT_THAT(theatre.health.reason(), HasSubstr("100.0 frames come a second, and frame_rate_hz says 60.0"));
  // Opened anew, it does not begin with some seconds of wrong stamps.
  theatre.session.on_open(theatre.host, theatre.now);
  theatre.device.on_open(theatre.far, theatre.now);
  theatre.run(seconds(4));
  EXPECT_EQ(theatre.samples.size(), before);
  EXPECT_EQ(theatre.health.state(), DeviceState::kSilent);
  EXPECT_THAT(theatre.health.reason(), HasSubstr("frame_rate_hz says 60.0"));
}

TEST(NdiSession, SaysWhatIsWrongWithTheTools) {
  NdiSettings none = wired();
  Theatre without(none, {});
  without.run(seconds(10));
  EXPECT_THAT(without.host.failure, HasSubstr("knows no tool"));
  Theatre several(none, {.wired_tools = 2});
  several.run(seconds(10));
  EXPECT_THAT(several.host.failure, HasSubstr("several tools (0A, 0B): say by tracker.sensor which"));
  NdiSettings referenced = wired();
  referenced.reference = NdiTool{{}, 0x0A};
  Theatre alone(referenced, {.wired_tools = 1});
  alone.run(seconds(10));
  EXPECT_THAT(alone.host.failure, HasSubstr("knows no tool beside the reference"));
  Theatre three(referenced, {.wired_tools = 3});
  three.run(seconds(10));
  EXPECT_THAT(three.host.failure, HasSubstr("several tools beside the reference (0B, 0C)"));
  NdiSettings other = wired();
  other.sensor.handle = 0x0C;
  Theatre wrong(other, {.wired_tools = 2});
  wrong.run(seconds(10));
  EXPECT_THAT(wrong.host.failure, HasSubstr("no such tool: port handle 0C"));
}

TEST(NdiSession, ATrackerThatHasAnsweredIsNotAskedWhetherItIsSwitchedOn) {
  DeviceHealth health;
  NdiSession session(
      wired(), [](const TrackerSample&) { FAIL(); }, health);
  ScriptedLink link;
  session.on_open(link, kStart);
  session.on_bytes(link, bytes_of("OKAYA896\r"), kStart);
  EXPECT_EQ(health.awaited(), "it answers, but not yet to INIT:.");
  session.on_open(link, kStart + seconds(1));
  EXPECT_THAT(health.awaited(), HasSubstr("is it switched on?"));
}

TEST(NdiSession, SilenceAndStrangersAreTold) {
  Theatre theatre(wired(), {.wired_tools = 1});
  DeviceHealth health;
  NdiSession session(
      wired(), [](const TrackerSample&) { FAIL(); }, health);
  ScriptedLink link;
  session.on_open(link, kStart);
  EXPECT_EQ(health.awaited(), "no answer yet to TSTOP:; is it switched on?");
  session.on_time(link, session.next_time());  // no answer to TSTOP is none to INIT either
  EXPECT_EQ(health.awaited(), "no answer yet to INIT:; is it switched on?");
  session.on_time(link, session.next_time());
  EXPECT_THAT(link.failure, HasSubstr("no answer to INIT:"));
  ScriptedLink noisy;
  session.on_open(noisy, kStart);
  std::mt19937 random(5);
  for (int i = 0; i < 100 && noisy.failure.empty(); ++i) {
    std::vector<std::byte> noise(200);
    for (std::byte& b : noise) b = static_cast<std::byte>(random() % 256);
    session.on_bytes(noisy, noise, kStart + milliseconds(i));
  }
  EXPECT_THAT(noisy.failure, HasSubstr("damaged"));
}

}  // namespace
}  // namespace perimap
