#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/config/configuration_keys.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/configuration_text.hpp"
#include "daemon/config/session_keys.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Expected<Configuration> parse(std::string_view text) {
  return parse_configuration(text, "test.toml", {}, NamedFiles::kMayBeMissing);
}

constexpr const char* kSession =
    "version = 1\n[camera]\nframe_rate_hz = 25\n[tracker]\nposition_deviation_mm = 1.4\n"
    "hand_eye_translation_SC_mm = [1, 2, 3]\n[ecg]\nr_trigger = true\n[phase]\nlaw = \"warped\"\n"
    "[respiration]\nenabled = true\n[estimation]\nharmonics = 5\n";

TEST(RecordedConfiguration, SetsWhatDescribesItsSession) {
  const auto recorded = parse_recorded_configuration(kSession, "heart.mcap:configuration.toml");
  ASSERT_TRUE(recorded) << recorded.error().message;
  const Expected<Configuration> same = parse(kSession);
  ASSERT_TRUE(same) << same.error().message;
  EXPECT_EQ(recorded->configuration, *same);
  EXPECT_TRUE(recorded->passed_over.empty());
}

// One that came from elsewhere must not decide which files are written and what is published, or where.
TEST(RecordedConfiguration, IsRefusedAnythingElseByName) {
  for (const ConfigurationKey& key : configuration_keys()) {
    if (describes_session(key)) continue;
    const std::string text = "version = 1\n[" + key.section + "]\n" + key.name + " = 1\n";
    const auto recorded = parse_recorded_configuration(text, "heart.mcap:configuration.toml");
    ASSERT_FALSE(recorded) << key.section << "." << key.name;
    EXPECT_THAT(recorded.error().message, StartsWith("heart.mcap:configuration.toml:3:1: key '" + key.section + "." +
                                                     key.name + "': expected of a recording what describes its"));
  }
}

TEST(RecordedConfiguration, OfNoFileNoDeviceAndNothingOfTheRunMayBeSet) {
  for (const ConfigurationKey& key : configuration_keys()) {
    if (!describes_session(key)) continue;
    EXPECT_FALSE(key.names_file) << key.section << "." << key.name;
    for (const char* section : {"source", "replay", "pipeline", "features", "realtime", "dds", "recording", "status",
                                "log", "control", "checkpoint", "blackbox"}) {
      EXPECT_NE(key.section, section) << key.name;
    }
    for (const char* name : {"device", "protocol", "port", "device_channel", "r_trigger_port"}) {
      EXPECT_NE(key.name, name) << key.section;
    }
  }
}

TEST(RecordedConfiguration, MayBePassedOverWhatItMayNotSet) {
  const std::string text = std::string(kSession) + "[checkpoint]\nfile = \"/etc/passwd\"\n[dds]\ndomain = 7\n";
  const auto recorded = parse_recorded_configuration(text, "heart.mcap:configuration.toml", {}, OtherKeys::kPassedOver);
  ASSERT_TRUE(recorded) << recorded.error().message;
  EXPECT_EQ(recorded->configuration, *parse(kSession));
  ASSERT_EQ(recorded->passed_over.size(), 2U);
  EXPECT_THAT(recorded->passed_over[0].message, HasSubstr("key 'checkpoint.file'"));
  EXPECT_THAT(recorded->passed_over[1].message, HasSubstr("key 'dds.domain'"));
  // What is wrong is wrong all the same.
  EXPECT_FALSE(parse_recorded_configuration("version = 1\n[dds]\ndomain = 7\n[phase]\nlaw = 3\n", "x", {},
                                            OtherKeys::kPassedOver));
}

TEST(RecordedConfiguration, WhatIsPrintedOfASessionIsTakenFromARecording) {
  Configuration configuration = *parse(kSession);
  configuration.source.name = "theatre 3";
  configuration.dds.domain = 7;
  configuration.tracker.port = "/dev/ttyUSB0";
  configuration.tracker.translation_IW_mm[0] = 5.0;
  const auto recorded = parse_recorded_configuration(session_toml(configuration), "x");
  ASSERT_TRUE(recorded) << recorded.error().message;
  EXPECT_EQ(recorded->configuration, *parse(kSession));
}

}  // namespace
}  // namespace perimap
