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

TEST(EmulatedTool, IsReadWithItsMotion) {
  EXPECT_EQ(parse_emulated_tool("0C=sway").value().motion, EmulatedTool::Motion::kSwaying);
  EXPECT_EQ(parse_emulated_tool("0C=pivot").value().tip_O_mm, Vector3d(0, 0, 150));
  EXPECT_EQ(parse_emulated_tool("Pointer 2=pivot:-1.5,2,3e1").value().tip_O_mm, Vector3d(-1.5, 2, 30));
  const auto still = parse_emulated_tool("0B=still:1,2,3,0,0,1,0");
  ASSERT_TRUE(still) << still.error().message;
  EXPECT_EQ(still->place.t, Vector3d(1, 2, 3));
  EXPECT_EQ(port_handle_of("0C").value(), 0x0C);
}

TEST(EmulatedTool, WhatIsNoneIsRefusedByName) {
  for (const char* text :
       {"", "=", "0C", "=sway", "0C=", "0C=swaying", "0C=pivot:", "0C=pivot:1,2", "0C=pivot:1,2,3,4", "0C=pivot:1,2,x",
        "0C=pivot:1,2,inf", "0C=still", "0C=still:1,2,3", "0C=still:0,0,0,1,1,0,0", "0C=/nowhere/poses.csv",
        "a name of more than 20=sway", "0C=pivot:1,,3", "0C=pivot:1,2,3,"}) {
    const auto tool = parse_emulated_tool(text);
    ASSERT_FALSE(tool) << text;
    EXPECT_THAT(tool.error().message, HasSubstr("--tool")) << text;
  }
  for (const char* handle : {"", "0x", "G1", "100", "-1", " 1"}) EXPECT_FALSE(port_handle_of(handle)) << handle;
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
