#include "daemon/probe/probe_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perimap {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr auto kPeriod = std::chrono::milliseconds(4);

ProbedDevices one(const char* kind, DeviceState state) {
  ProbedDevices devices;
  devices.push_back(std::make_unique<ProbedDevice>());
  ProbedDevice& device = *devices.back();
  device.kind = kind;
  device.where = "tcp:127.0.0.1:1";
  device.state = state;
  device.health.set_state(state);
  return devices;
}

TEST(ProbedSamples, TheirRateIsThatOfTheirStamps) {
  ProbedSamples samples;
  EXPECT_EQ(samples.rate_hz(), 0.0);
  // Blocks of five: those of the first stamp do not count.
  for (int block = 1; block <= 51; ++block) samples.add(Instant(5 * block * kPeriod), 5);
  EXPECT_EQ(samples.count, 255U);
  EXPECT_NEAR(samples.rate_hz(), 250.0, 1e-9);
}

TEST(ProbeReport, WhatStreamsIsWell) {
  auto devices = one("ecg", DeviceState::kStreaming);
  devices.front()->health.set_identity("board V3");
  devices.front()->health.samples.add(2);
  devices.front()->seen.add(Instant(kPeriod), 1);
  devices.front()->seen.add(Instant(2 * kPeriod), 1);
  EXPECT_TRUE(all_well(devices));
  const std::string text = to_text(devices);
  EXPECT_THAT(text, HasSubstr("ecg at tcp:127.0.0.1:1: streaming\n  identity   board V3\n  rate       250.00 Hz"));
  EXPECT_THAT(text, Not(HasSubstr("why")));
  const auto json = to_json(devices);
  EXPECT_EQ(json["ecg"]["state"], "streaming");
  EXPECT_EQ(json["ecg"]["identity"], "board V3");
  EXPECT_NEAR(json["ecg"]["rate_hz"].get<double>(), 250.0, 1e-9);
}

TEST(ProbeReport, WhatDoesNotStreamIsToldWhyItMayNot) {
  auto devices = one("tracker", DeviceState::kStarting);
  EXPECT_FALSE(all_well(devices));
  EXPECT_THAT(to_text(devices), HasSubstr("why        open, but nothing has come yet: listen for longer (--seconds)"));
  devices.front()->health.set_awaited("no answer yet to INIT:.");
  EXPECT_THAT(to_text(devices), HasSubstr("why        open: no answer yet to INIT:. Listen for longer"));
  devices.front()->health.set_reason("refused");
  EXPECT_THAT(to_text(devices), HasSubstr("why        refused\n"));
  EXPECT_THAT(to_text(one("r_trigger", DeviceState::kStarting)), HasSubstr("the line has not changed"));
  EXPECT_THAT(to_text(one("camera", DeviceState::kSilent)), HasSubstr("samples came and have stopped"));
}

TEST(ProbeReport, WhatIsNoSampleIsToldInTheDevicesOwnWords) {
  for (const auto& [kind, told] :
       {std::pair("camera", "1 of 4 frames cannot be decoded"), std::pair("ecg", "lead off in 1 of 4 samples"),
        std::pair("tracker", "tool missing in 1, out of volume in 0, disabled in 0 of 4")}) {
    auto devices = one(kind, DeviceState::kStreaming);
    devices.front()->seen.add(Instant(kPeriod), 4);
    devices.front()->seen.invalid = 1;
    devices.front()->seen.tools[1] = 1;
    EXPECT_THAT(to_text(devices), HasSubstr(std::string("validity   ") + told)) << kind;
  }
}

TEST(ProbeReport, EachToolThatWasAskedForHasALine) {
  auto devices = one("tracker", DeviceState::kStreaming);
  for (int i = 0; i < 3; ++i) devices.front()->tools.emplace_back();
  devices.front()->tools[1].name = "pointer";
  devices.front()->tools[2].name = "instrument/0D";
  ProbedSamples& pointer = devices.front()->tools[1].seen;
  for (int i = 1; i <= 3; ++i) pointer.add(Instant(i * kPeriod), 1);
  pointer.tools = {2, 1, 0, 0};
  pointer.largest_error_mm = 0.4;
  const std::string text = to_text(devices);
  EXPECT_THAT(text, HasSubstr("  pointer: 3 readings, seen in 2, missing in 1, out of volume in 0, disabled in 0\n"));
  EXPECT_THAT(text, HasSubstr("  instrument/0D: no reading\n"));
  const auto json = to_json(devices);
  EXPECT_EQ(json["tracker"]["tools"].size(), 2U);
  EXPECT_EQ(json["tracker"]["tools"]["pointer"]["ok"], 2);
  EXPECT_EQ(json["tracker"]["tools"]["pointer"]["largest_error_mm"], 0.4);
}

TEST(ProbeReport, WhatADeviceIsUsedInSpiteOfIsToldWhileItStreams) {
  auto devices = one("tracker", DeviceState::kStreaming);
  EXPECT_THAT(to_text(devices), Not(HasSubstr("note")));
  devices.front()->health.set_notice("the pointer is not there");
  devices.front()->health.misnumbered.add(3);
  EXPECT_THAT(to_text(devices), HasSubstr("  note       the pointer is not there\n"));
  EXPECT_EQ(to_json(devices)["tracker"]["notice"], "the pointer is not there");
  EXPECT_EQ(to_json(devices)["tracker"]["misnumbered"], 3);
  EXPECT_TRUE(all_well(devices));
}

TEST(ProbeReport, BreathingStandsWithTheDeviceThatHearsIt) {
  auto devices = one("ecg", DeviceState::kStreaming);
  devices.front()->respiration_channel = 4;
  EXPECT_THAT(to_text(devices), HasSubstr("breathing  input 4: 0 samples\n"));
  EXPECT_EQ(to_json(devices)["ecg"]["respiration"]["channel"], 4);
  devices.front()->respiration_channel = 0;
  EXPECT_THAT(to_text(devices), Not(HasSubstr("breathing")));
}

}  // namespace
}  // namespace perimap
