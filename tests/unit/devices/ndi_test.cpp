// The NDI Combined API: checks, framing, decoding, and whole sessions with the emulated device.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <random>

#include "drivers/standins/emulator/ndi_emulator.hpp"
#include "drivers/tracker/ndi_session.hpp"
#include "scripted_link.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

const Instant kStart(seconds(100));

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

TEST(NdiCrc, AgreesWithTheGuidesExamples) {
  for (const std::string whole : {"OKAYA896", "RESETBE6F", "INIT:E3A5", "TSTART:801B0B", "TSTOP:2C14", "BX:080100EC",
                                  "TX:0001031A", "PHSR:02E17E", "COMM:500000048"}) {
    EXPECT_EQ(ndi_with_crc(whole.substr(0, whole.size() - 4)), whole + "\r");
  }
}

// ---- framing

std::vector<std::byte> framed(const std::vector<std::byte>& body, bool long_form = false) {
  std::vector<std::byte> all{long_form ? std::byte{0xC8} : std::byte{0xC4}, std::byte{0xA5}};
  const auto put = [&all](std::size_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) all.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFFU));
  };
  put(body.size(), long_form ? 4 : 2);
  put(ndi_crc(all), 2);
  all.insert(all.end(), body.begin(), body.end());
  put(ndi_crc(body), 2);
  return all;
}

std::string kind_of(NdiReplyFramer& framer) {
  const auto reply = framer.next();
  if (!reply) return "more";
  if (const auto* text = std::get_if<NdiText>(&*reply)) return "text " + text->text;
  if (const auto* binary = std::get_if<NdiBinary>(&*reply)) return "binary " + std::to_string(binary->body.size());
  return "damaged";
}

TEST(NdiReplyFramer, TakesRepliesInAnyChunks) {
  std::vector<std::byte> stream = bytes_of("OKAYA896\r");
  for (const bool long_form : {false, true}) {
    const auto binary = framed(bytes_of("some body"), long_form);
    stream.insert(stream.end(), binary.begin(), binary.end());
  }
  for (std::size_t cut = 1; cut <= stream.size(); ++cut) {
    NdiReplyFramer framer;
    std::vector<std::string> kinds;
    for (std::size_t at = 0; at < stream.size(); at += cut) {
      framer.feed(std::span(stream).subspan(at, std::min(cut, stream.size() - at)));
      for (std::string kind = kind_of(framer); kind != "more"; kind = kind_of(framer)) kinds.push_back(kind);
    }
    EXPECT_THAT(kinds, ::testing::ElementsAre("text OKAY", "binary 9", "binary 9"));
  }
}

TEST(NdiReplyFramer, EveryFlippedBitIsNoticed) {
  for (const auto& good : {bytes_of("OKAYA896\r"), framed(bytes_of("body")), framed(bytes_of("body"), true)}) {
    for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
      auto bad = good;
      bad[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      NdiReplyFramer framer;
      framer.feed(bad);
      // A flipped end of text, or a byte that no longer announces binary, leaves the reply waiting for an end.
      EXPECT_THAT(kind_of(framer), ::testing::AnyOf("damaged", "more")) << bit;
    }
  }
}

TEST(NdiReplyFramer, RefusesWhatCannotBeAReply) {
  struct Case {
    const char* what;
    std::vector<std::byte> bytes;
    const char* kind;
  };
  std::vector<std::byte> huge{std::byte{0xC8}, std::byte{0xA5}, std::byte{0},
                              std::byte{0},    std::byte{0},    std::byte{0x7F}};
  const auto crc = ndi_crc(huge);
  huge.push_back(static_cast<std::byte>(crc & 0xFFU));
  huge.push_back(static_cast<std::byte>(crc >> 8U));
  const Case cases[] = {
      {"nothing", {}, "more"},
      {"an empty line", bytes_of("\r"), "damaged"},
      {"a CRC alone", bytes_of("A896\r"), "damaged"},
      {"lower-case digits of a wrong CRC", bytes_of("OKAYzz96\r"), "damaged"},
      {"truncated text", bytes_of("OKAYA8"), "more"},
      {"binary start, then text", bytes_of("\xC4OKAYA896\r"), "damaged"},
      {"a body of 2 GB", huge, "damaged"},
      {"text without end", std::vector<std::byte>(10000, std::byte{'A'}), "damaged"},
      {"an empty body", framed({}), "binary 0"},
  };
  for (const Case& c : cases) {
    NdiReplyFramer framer;
    framer.feed(c.bytes);
    EXPECT_EQ(kind_of(framer), c.kind) << c.what;
  }
}

// ---- decoding

struct Body {
  std::vector<std::byte> all;
  Body& u(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) all.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFFU));
    return *this;
  }
  Body& floats(std::initializer_list<double> values) {
    for (const double v : values) u(std::bit_cast<std::uint32_t>(static_cast<float>(v)), 4);
    return *this;
  }
};

// Tools: 0A valid, 0B missing, 0C disabled, 0D out of volume.
std::vector<std::byte> bx_body() {
  Body body;
  body.u(4, 1);
  body.u(0x0A, 1).u(1, 1).floats({1, 0, 0, 0, 10, 20, -30, 0.2}).u(0x31, 4).u(1234, 4);
  body.u(0x0B, 1).u(2, 1).u(0x31, 4).u(1234, 4);
  body.u(0x0C, 1).u(4, 1);
  body.u(0x0D, 1).u(1, 1).floats({1, 0, 0, 0, 10, 20, -30, 0.2}).u(0x71, 4).u(1234, 4);
  return body.u(0, 2).all;
}

std::vector<std::byte> bx2_body() {
  Body tools;
  tools.u(0x0A, 2).u(0, 2).floats({1, 0, 0, 0, 10, 20, -30, 0.2});
  tools.u(0x0B, 2).u(0x011F, 2);
  tools.u(0x0C, 2).u(0x0120, 2);
  tools.u(0x0D, 2).u(0x0109, 2);
  Body item;
  item.u(1, 1).u(7, 1).u(0, 2).u(1234, 4).u(20, 4).u(500, 4);
  item.u(1, 2).u(2, 2);                               // container of two components
  item.u(0x12, 2).u(16, 4).u(0, 2).u(1, 4).u(99, 4);  // alerts: passed over
  item.u(2, 2).u(12 + tools.all.size(), 4).u(0, 2).u(4, 4);
  item.all.insert(item.all.end(), tools.all.begin(), tools.all.end());
  Body body;
  body.u(1, 2).u(1, 2).u(1, 2).u(12 + item.all.size(), 4).u(0, 2).u(1, 4);
  body.all.insert(body.all.end(), item.all.begin(), item.all.end());
  return body.all;
}

const std::string kTx =
    "04"
    "0A+10000+00000+00000+00000+001000+002000-003000+00200"
    "00000031000004D2\n"
    "0BMISSING00000031000004D2\n"
    "0CDISABLED\n"
    "0DMISSING00000071000004D2\n"
    "0000";

void expect_four_tools(const Expected<NdiTracking>& tracking) {
  ASSERT_TRUE(tracking) << tracking.error().message;
  ASSERT_EQ(tracking->tools.size(), 4U);
  const ToolState states[] = {ToolState::kOk, ToolState::kMissing, ToolState::kDisabled, ToolState::kOutOfVolume};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(tracking->tools[i].handle, 0x0A + i);
    EXPECT_EQ(tracking->tools[i].reading.state, states[i]) << i;
  }
  EXPECT_EQ(tracking->tools[0].frame, 1234U);
  EXPECT_TRUE(tracking->tools[0].reading.X_TO.t.isApprox(Vector3d(10, 20, -30), 1e-6));
}

TEST(NdiTracking, KeepsValidMissingDisabledAndOutOfVolumeApart) {
  expect_four_tools(decode_bx(bx_body()));
  expect_four_tools(decode_bx2(bx2_body()));
  expect_four_tools(decode_tx(kTx));
}

TEST(NdiTracking, EveryTruncationAndEveryExcessIsAnError) {
  const auto bx = bx_body();
  const auto bx2 = bx2_body();
  for (std::size_t size = 0; size < bx.size(); ++size) EXPECT_FALSE(decode_bx(std::span(bx).first(size))) << size;
  for (std::size_t size = 0; size < bx2.size(); ++size) EXPECT_FALSE(decode_bx2(std::span(bx2).first(size))) << size;
  for (std::size_t size = 0; size < kTx.size(); ++size) EXPECT_FALSE(decode_tx(kTx.substr(0, size))) << size;
  auto longer = bx_body();
  longer.push_back(std::byte{0});
  EXPECT_FALSE(decode_bx(longer));
  longer = bx2_body();
  longer.push_back(std::byte{0});
  EXPECT_FALSE(decode_bx2(longer));
  EXPECT_FALSE(decode_tx(kTx + "0"));
}

TEST(NdiTracking, ATransformThatIsNoPoseIsAnError) {
  const double nan = std::nan("");
  for (const std::initializer_list<double> floats : {std::initializer_list<double>{0, 0, 0, 0, 1, 2, 3, 0},
                                                     {nan, 0, 0, 0, 1, 2, 3, 0},
                                                     {1, 0, 0, 0, nan, 2, 3, 0},
                                                     {1, 0, 0, 0, 1e30, 2, 3, 0},
                                                     {-3.697314e28, 0, 0, 0, 0, 0, 0, 0},
                                                     {1, 1, 0, 0, 1, 2, 3, 0}}) {
    EXPECT_FALSE(decode_bx(Body().u(1, 1).u(0x0A, 1).u(1, 1).floats(floats).u(0x31, 4).u(1, 4).u(0, 2).all));
  }
}

TEST(NdiTracking, UnknownStatesAndLyingCountsAreErrors) {
  EXPECT_FALSE(decode_bx(Body().u(1, 1).u(0x0A, 1).u(3, 1).u(0, 2).all));
  EXPECT_FALSE(decode_bx(Body().u(255, 1).u(0x0A, 1).u(4, 1).u(0, 2).all));
  // A component that claims four thousand million items, one that is shorter than its header, one outside a frame.
  EXPECT_FALSE(decode_bx2(Body().u(1, 2).u(1, 2).u(1, 2).u(12, 4).u(0, 2).u(0xFFFFFFFF, 4).all));
  EXPECT_FALSE(decode_bx2(Body().u(1, 2).u(1, 2).u(2, 2).u(3, 4).u(0, 2).u(0, 4).all));
  EXPECT_FALSE(decode_bx2(Body().u(1, 2).u(1, 2).u(2, 2).u(16, 4).u(0, 2).u(1, 4).u(0x0A, 2).u(0x100, 2).all));
  EXPECT_FALSE(decode_tx("010AUNKNOWN0000003100000001\n0000"));
  EXPECT_FALSE(decode_tx("FF0ADISABLED\n0000"));
}

// ---- sessions

const PoseTrack& track() {
  static const PoseTrack swaying = PoseTrack::swaying(kStart, 100.0);
  return swaying;
}

Pose swaying_at(std::uint32_t frame) { return track().at(frame).X_TO; }

// Session and emulated device, connected without a transport; time is made.
struct Theatre {
  Theatre(NdiSettings settings, const NdiEmulatorSettings& device_settings, bool serial = false,
          const EmulatorFaults& faults = {}, int baud = 0, const PoseTrack& poses = track())
      : far(serial, baud),
        device(poses, device_settings, faults),
        session(
            std::move(settings), [this](const TrackerSample& sample) { samples.push_back(sample); }, health),
        host(serial, baud) {
    device.on_open(far, now);
    session.on_open(host, now);
  }

  // One millisecond a round.
  void run(Duration longest) {
    for (const Instant end = now + longest; now < end && host.failure.empty(); now += milliseconds(1)) {
      const auto to_device = bytes_of(host.take_sent());
      sent.append(reinterpret_cast<const char*>(to_device.data()), to_device.size());
      if (far.baud() != host.baud()) far.set_line_rate(host.baud());  // both ends of one line
      device.on_bytes(far, to_device, now);
      device.on_time(far, now);
      const auto to_host = bytes_of(far.take_sent());
      if (!to_host.empty()) session.on_bytes(host, to_host, now);
      if (now >= session.next_time()) session.on_time(host, now);
    }
  }

  Instant now = kStart;
  std::vector<TrackerSample> samples;
  std::string sent;
  DeviceHealth health;
  ScriptedLink far;
  NdiEmulator device;
  NdiSession session;
  ScriptedLink host;
};

NdiSettings wired() {
  NdiSettings settings;
  settings.frame_rate_hz = 100.0;
  return settings;
}

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
