#include "drivers/standins/theatre/theatre_words.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perimap {
namespace {

using ::testing::HasSubstr;

TEST(TheatreWords, AreAddedToTheSettings) {
  TheatreWords words;
  words.missing_s = {5.0, 0.5};
  words.unplug_s = {9.0, 2.0};
  words.ndi_reference = {1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0};
  words.tools = {"0C=sway"};
  words.broken = {"0D"};
  words.frame_jump = {0.0, -7.4};
  const auto settings = with_words({}, words);
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->faults.missing_every, std::chrono::seconds(5));
  EXPECT_EQ(settings->faults.missing_for, std::chrono::milliseconds(500));
  EXPECT_EQ(settings->faults.unplug_every, std::chrono::seconds(9));
  EXPECT_EQ(settings->faults.unplug_for, std::chrono::seconds(2));
  EXPECT_TRUE(settings->ndi.reference);
  EXPECT_EQ(settings->ndi.wired_tools, 2) << "where tools are wired, the reference is too";
  EXPECT_EQ(settings->tools.size(), 1U);
  EXPECT_EQ(settings->ndi.broken.size(), 1U);
  EXPECT_EQ(settings->ndi.jump_every, std::chrono::milliseconds(10)) << "never without a pause";
  EXPECT_EQ(settings->ndi.jump_by, -7);
}

TEST(TheatreWords, WithoutAnyTheSettingsStay) {
  const TheatreSettings before;
  const auto settings = with_words(before, {});
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->faults.missing_every, before.faults.missing_every);
  EXPECT_EQ(settings->ndi.wired_tools, before.ndi.wired_tools);
  EXPECT_EQ(settings->ndi.jump_every, before.ndi.jump_every);
}

TEST(TheatreWords, WhatCannotBeReadIsRefused) {
  TheatreWords words;
  words.tools = {"nothing"};
  EXPECT_FALSE(with_words({}, words));
  words = {};
  words.broken = {"handle"};
  EXPECT_FALSE(with_words({}, words));
  words = {};
  words.ndi_reference = {1.0};
  EXPECT_THAT(with_words({}, words).error().message, HasSubstr("--ndi-reference"));
}

TEST(EmulatedDevices, FramesOverCanTakeADeviceThatSendsThem) {
  EXPECT_TRUE(parse_emulated_devices({"ndi", "can-ecg"}, {}, true));
  EXPECT_THAT(parse_emulated_devices({"ndi"}, {}, true).error().message, HasSubstr("expected the device 'can-ecg'"));
  TheatreSettings settings;
  settings.can.identifier = 0x800;
  EXPECT_THAT(parse_emulated_devices({"can-ecg"}, settings, true).error().message, HasSubstr("at most 0x7FF"));
  settings.can.extended = true;
  EXPECT_TRUE(parse_emulated_devices({"can-ecg"}, settings, true));
}

}  // namespace
}  // namespace perimap
