#include "drivers/standins/theatre/emulated_device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/standins/theatre/theatre.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

TEST(EmulatedDevice, IsAtItsUsualPlaceOrWhereItIsSaidToBe) {
  const auto usual = parse_emulated_device("ndi");
  ASSERT_TRUE(usual) << usual.error().message;
  EXPECT_EQ(format_endpoint(usual->where), "tcp:127.0.0.1:8765");
  const auto elsewhere = parse_emulated_device("cyton=/tmp/line");
  ASSERT_TRUE(elsewhere) << elsewhere.error().message;
  EXPECT_EQ(format_endpoint(elsewhere->where), "/tmp/line");
  const auto camera = parse_emulated_device("camera=v4l2:/dev/video9");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->video_output, "/dev/video9");
}

TEST(EmulatedDevice, ThatCannotBeIsRefusedWithWhatCould) {
  for (const auto& [text, told] :
       {std::pair("cytn", "did you mean 'cyton'?"), std::pair("x", "expected ndi, igtl, "),
        std::pair("can-ecg=/tmp/line", "cannot be at /tmp/line"), std::pair("ndi=can:can0", "cannot be at can:can0"),
        std::pair("ndi=tcp:192.0.2.7:1", "listens on this host alone"),
        std::pair("camera", "expected camera=v4l2:/dev/videoN")}) {
    const auto device = parse_emulated_device(text);
    ASSERT_FALSE(device) << text;
    EXPECT_THAT(device.error().message, HasSubstr(told));
  }
}

TEST(EmulatedDevice, OnlyWhatItsWayCanDoToItsBytesIsDone) {
  EmulatorFaults faults;
  faults.truncated = 0.1;
  EXPECT_FALSE(check_faults(parse_emulated_device("can-ecg").value(), faults));
  EXPECT_TRUE(check_faults(parse_emulated_device("ndi").value(), faults));
  EXPECT_TRUE(check_faults(parse_emulated_device("camera=v4l2:/dev/video9").value(), faults));
  faults.garbled = 0.1;
  EXPECT_FALSE(check_faults(parse_emulated_device("camera=v4l2:/dev/video9").value(), faults));
}

TEST(Theatre, APlaceHasAUnitQuaternion) {
  const auto place = parse_place({10, 0, -520, 1, 0, 0, 0}, "--ndi-reference");
  ASSERT_TRUE(place) << place.error().message;
  EXPECT_EQ(place->t, Vector3d(10, 0, -520));
  EXPECT_THAT(parse_place({0, 0, 0, 1, 1, 0, 0}, "--ndi-reference").error().message,
              HasSubstr("--ndi-reference: expected a rotation W X Y Z of norm 1"));
}

TEST(Theatre, WhatIsNoRecordingIsNotPlayed) {
  TheatreSettings settings;
  settings.recording = "/nowhere/heart.mcap";
  const auto theatre = Theatre::create(settings, false);
  ASSERT_FALSE(theatre);
  EXPECT_THAT(theatre.error().message, HasSubstr("/nowhere/heart.mcap"));
}

}  // namespace
}  // namespace perimap
