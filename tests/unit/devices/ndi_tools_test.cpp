// Several tools of one NDI tracker.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "ndi_theatre.hpp"

namespace perimap {
namespace {

using Newest = NdiEmulatorSettings::Newest;

const Vector3d kTip(0, 0, 150);
const Pose kReference{so3_exp(Vector3d(0.1, 0.2, -0.3)), Vector3d(40, -10, -620)};

NdiSettings scope_patient_and_pointer() {
  NdiSettings settings = wired();
  settings.sensor.handle = 0x0A;
  settings.reference = NdiTool{{}, 0x0B};
  settings.tools.push_back({{}, 0x0C, "pointer"});
  return settings;
}

NdiEmulatorSettings with_pointer(Newest newest = Newest::kBx2) {
  return {.newest = newest,
          .wired_tools = 2,
          .reference = kReference,
          .tools = {{0x0C, PoseTrack::pivoting(kStart, 100.0, kTip)}}};
}

TEST(NdiTools, AllAreReadByOneConnectionEachAtItsInstant) {
  const PoseTrack pointer = PoseTrack::pivoting(kStart, 100.0, kTip);
  for (const Newest newest : {Newest::kBx2, Newest::kBx, Newest::kTx}) {
    SCOPED_TRACE(static_cast<int>(newest));
    Theatre theatre(scope_patient_and_pointer(), with_pointer(newest));
    theatre.run(seconds(3));
    ASSERT_EQ(theatre.host.failure, "");
    EXPECT_EQ(theatre.health.notice(), "");
    ASSERT_GT(theatre.samples.size(), 250U);
    ASSERT_EQ(theatre.tools.size(), 2 * theatre.samples.size());
    const double rounding_mm = newest == Newest::kTx ? 0.1 : 1e-3;
    const Vector3d tip_W = kReference.inverse() * (pointer.at(0).X_TO * kTip);
    for (const ToolSample& tool : theatre.tools) {
      ASSERT_EQ(tool.state, ToolState::kOk);
      ASSERT_LE(tool.source_time, tool.arrival);
      const auto same = std::find_if(theatre.samples.begin(), theatre.samples.end(),
                                     [&](const auto& s) { return s.device_frame == tool.device_frame; });
      ASSERT_NE(same, theatre.samples.end());
      EXPECT_EQ(tool.source_time, same->source_time);
      if (tool.tool == 0) {
        ASSERT_LT((tool.X_WS.t - kReference.t).norm(), rounding_mm) << "in the tracker's own frame";
      } else {
        ASSERT_EQ(tool.tool, 1U);
        ASSERT_LT((tool.X_WS * kTip - tip_W).norm(), rounding_mm) << "in the reference's frame";
      }
    }
  }
}

TEST(NdiTools, WithoutASensorsNameItIsTheOneThatIsNoOthers) {
  NdiSettings settings = scope_patient_and_pointer();
  settings.sensor.handle.reset();
  Theatre theatre(settings, with_pointer());
  theatre.run(seconds(1));
  ASSERT_EQ(theatre.host.failure, "");
  ASSERT_FALSE(theatre.samples.empty());
  EXPECT_LT((kReference * theatre.samples.back().X_WS.t - swaying_at(theatre.samples.back().device_frame).t).norm(),
            1e-3);
}

TEST(NdiTools, ADefinitionIsUploadedForEach) {
  NdiSettings settings = wired();
  settings.sensor.definition = std::vector<std::byte>(70, std::byte{1});
  settings.reference = NdiTool{std::vector<std::byte>(60, std::byte{2}), std::nullopt};
  settings.tools.push_back({std::vector<std::byte>(130, std::byte{3}), std::nullopt, "pointer"});
  Theatre theatre(settings, {.reference = kReference, .tools = {{0x03, PoseTrack::still(kStart, kReference)}}});
  theatre.run(seconds(1));
  ASSERT_EQ(theatre.host.failure, "");
  EXPECT_EQ(theatre.device.definition(3).front(), std::byte{3});
  EXPECT_EQ(theatre.device.definition(3).size(), 192U);
  ASSERT_FALSE(theatre.tools.empty());
  EXPECT_EQ(theatre.tools.back().tool, 1U);
  EXPECT_LT(theatre.tools.back().X_WS.t.norm(), 1e-3) << "at the reference itself";
}

TEST(NdiTools, APortThatFailsAndNobodyAskedForIsLeftAloneAndTold) {
  NdiEmulatorSettings device = with_pointer();
  device.broken = {0x0D};
  device.tools.emplace(0x0D, PoseTrack::still(kStart, kReference));
  Theatre theatre(scope_patient_and_pointer(), device);
  theatre.run(seconds(2));
  ASSERT_EQ(theatre.host.failure, "");
  EXPECT_GT(theatre.samples.size(), 150U);
  EXPECT_THAT(theatre.health.notice(), HasSubstr("port handle 0D, which nobody asked for"));
  EXPECT_THAT(theatre.health.notice(), HasSubstr("ERROR13"));
}

// The one that is left need not be the scope's.
TEST(NdiTools, WithoutASensorsNameAPortThatFailsMayBeTheSensor) {
  NdiEmulatorSettings device = with_pointer();
  device.broken = {0x0A};
  device.tools.emplace(0x0D, PoseTrack::still(kStart, kReference));
  NdiSettings settings = scope_patient_and_pointer();
  settings.sensor.handle.reset();
  Theatre theatre(settings, device);
  theatre.run(seconds(2));
  EXPECT_TRUE(theatre.samples.empty());
  EXPECT_THAT(theatre.host.failure,
              HasSubstr("several tools beside those that were named (0D; 0A, which cannot be used"));
  EXPECT_THAT(theatre.host.failure, HasSubstr("tracker.sensor"));
}

TEST(NdiTools, APortThatFailsAndWasAskedForIsAnErrorThatNamesIt) {
  for (const auto& [handle, name] : {std::pair{0x0A, "the sensor"}, {0x0B, "the reference"}, {0x0C, "the pointer"}}) {
    NdiEmulatorSettings device = with_pointer();
    device.broken = {static_cast<std::uint16_t>(handle)};
    Theatre theatre(scope_patient_and_pointer(), device);
    theatre.run(seconds(2));
    EXPECT_THAT(theatre.host.failure, HasSubstr(fmt::format("{}, port handle {:02X}, cannot be used", name, handle)));
    EXPECT_THAT(theatre.host.failure, HasSubstr("ERROR13"));
    EXPECT_TRUE(theatre.samples.empty());
  }
}

TEST(NdiTools, WhereTheOnlyToolFailsItIsSaidWhy) {
  Theatre theatre(wired(), {.wired_tools = 1, .broken = {0x0A}});
  theatre.run(seconds(2));
  EXPECT_THAT(theatre.host.failure, HasSubstr("the tracker knows no tool"));
  EXPECT_THAT(theatre.host.failure, HasSubstr("port handle 0A: ERROR13"));
}

TEST(NdiTools, APointerThatIsNotThereIsToldAndTheSensorGoesOn) {
  Theatre theatre(scope_patient_and_pointer(), {.wired_tools = 2, .reference = kReference});
  theatre.run(seconds(1));
  ASSERT_EQ(theatre.host.failure, "");
  EXPECT_GT(theatre.samples.size(), 50U);
  EXPECT_EQ(theatre.health.notice(), "the pointer is not there: no port handle 0C; there are: 0A, 0B");
}

TEST(NdiTools, TheDevicesOwnErrorIsToldAndOfTwoToolsBoth) {
  for (const Newest newest : {Newest::kBx2, Newest::kBx, Newest::kTx}) {
    NdiEmulatorSettings device = with_pointer(newest);
    device.error_mm = 0.3;
    Theatre theatre(scope_patient_and_pointer(), device);
    theatre.run(seconds(1));
    ASSERT_FALSE(theatre.samples.empty());
    EXPECT_NEAR(theatre.samples.back().error_mm, 0.3 * std::sqrt(2.0), 1e-3);
    for (const ToolSample& tool : theatre.tools) {
      EXPECT_NEAR(tool.error_mm, tool.tool == 0 ? 0.3 : 0.3 * std::sqrt(2.0), 1e-3);
    }
  }
}

// BX: one tool that is marked valid.
TEST(NdiTools, APoseWhoseOwnErrorIsAbsurdIsMissing) {
  const auto decoded = [](float error_mm) {
    std::vector<std::byte> body{std::byte{1}, std::byte{0x0A}, std::byte{1}};
    const auto put = [&body](std::uint32_t bits, int bytes) {
      for (int i = 0; i < bytes; ++i)
        body.push_back(static_cast<std::byte>(bits >> (8U * static_cast<unsigned>(i)) & 0xFFU));
    };
    for (const float value : {1.0F, 0.0F, 0.0F, 0.0F, 10.0F, 20.0F, -500.0F, error_mm})
      put(std::bit_cast<std::uint32_t>(value), 4);
    put(0x31, 4);
    put(7, 4);
    put(0, 2);
    return decode_bx(body).value().tools.at(0).reading;
  };
  for (const float none : {0.0F, -3.697314e28F}) {
    EXPECT_EQ(decoded(none).state, ToolState::kOk);
    EXPECT_EQ(decoded(none).error_mm, 0.0);
  }
  EXPECT_NEAR(decoded(0.25F).error_mm, 0.25, 1e-9);
  for (const float absurd :
       {-0.1F, 1001.0F, 1e30F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_EQ(decoded(absurd).state, ToolState::kMissing) << absurd;
  }
}

TEST(NdiFrameNumbers, ThatGoBackOrJumpAreToldAndCountedAndGiveNoPose) {
  for (const std::int64_t by : {-70, 10000, -100000}) {
    SCOPED_TRACE(by);
    Theatre theatre(wired(), {.wired_tools = 1, .jump_every = seconds(1), .jump_by = by});
    theatre.run(milliseconds(4500));
    ASSERT_EQ(theatre.host.failure, "");
    EXPECT_EQ(theatre.health.misnumbered.get(), 4U);
    EXPECT_EQ(theatre.health.state(), DeviceState::kStreaming);
    EXPECT_THAT(theatre.health.notice(), HasSubstr("frame numbers went back or jumped, 4 times by now"));
    EXPECT_EQ(theatre.health.lost.get(), 0U) << "a jump is no loss";
    ASSERT_GT(theatre.samples.size(), 400U);
    for (const TrackerSample& sample : theatre.samples) {
      // Each is stamped within the time that a frame is there before it is asked for.
      const auto measured = (sample.arrival - kStart) / milliseconds(10) * milliseconds(10) + kStart;
      ASSERT_LT(std::abs(to_seconds(sample.source_time - measured)), 8e-3);
    }
  }
}

TEST(NdiFrameNumbers, AFrameThatGivesNoPoseGivesNoneOfTheOtherToolsEither) {
  NdiEmulatorSettings device = with_pointer();
  device.jump_every = milliseconds(500);
  device.jump_by = -20;
  Theatre theatre(scope_patient_and_pointer(), device);
  theatre.run(milliseconds(2300));
  EXPECT_EQ(theatre.health.misnumbered.get(), 4U);
  EXPECT_EQ(theatre.tools.size(), 2 * theatre.samples.size());
}

TEST(NdiFrameNumbers, ThatAreNeverRightMakeTheTrackerSilentWithThatReason) {
  Theatre theatre(wired(), {.wired_tools = 1, .jump_every = milliseconds(10), .jump_by = -2});
  theatre.run(seconds(3));
  EXPECT_EQ(theatre.host.failure, "") << "a new start would help nobody";
  EXPECT_EQ(theatre.health.state(), DeviceState::kSilent);
  EXPECT_THAT(theatre.health.reason(), HasSubstr("frame numbers went back or jumped"));
  EXPECT_LE(theatre.samples.size(), 1U);
  EXPECT_GT(theatre.health.misnumbered.get(), 200U);
}

TEST(NdiFrameNumbers, APauseOfTheHostIsNoJump) {
  Theatre theatre(wired(), {.wired_tools = 1});
  theatre.run(seconds(2));
  theatre.now += milliseconds(1500);
  theatre.run(seconds(2));
  ASSERT_EQ(theatre.host.failure, "");
  EXPECT_EQ(theatre.health.misnumbered.get(), 0U);
  EXPECT_GT(theatre.health.lost.get(), 100U);
}

}  // namespace
}  // namespace perimap
