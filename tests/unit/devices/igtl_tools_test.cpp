// Several tools of one OpenIGTLink server, and servers whose stamps are no good.
#include <algorithm>

#include "igtl_theatre.hpp"

namespace perimap {
namespace {

using Message = IgtlEmulatorSettings::Message;
using Stamps = IgtlEmulatorSettings::Stamps;

const Vector3d kTip(0, 0, 150);
const Pose kReference{so3_exp(Vector3d(0.1, 0.2, -0.3)), Vector3d(40, -10, -620)};

IgtlSettings scope_patient_and_pointer() {
  return {.sensor = "Scope", .reference = "Patient", .world = {}, .tools = {"Pointer", "Grasper"}};
}

TEST(IgtlTools, AllAreReadByOneConnectionEachAtItsInstant) {
  const PoseTrack pointer = PoseTrack::pivoting(kStart, 50.0, kTip);
  for (const Message message : {Message::kTransform, Message::kTdata, Message::kPosition}) {
    SCOPED_TRACE(static_cast<int>(message));
    IgtlTheatre theatre(
        scope_patient_and_pointer(),
        {.message = message, .others = {{"Patient", PoseTrack::still(kStart, kReference)}, {"Pointer", pointer}}});
    theatre.run(seconds(4));
    ASSERT_EQ(theatre.host.failure, "");
    const Vector3d tip_W = kReference.inverse() * (pointer.at(0).X_TO * kTip);
    std::size_t count[3] = {};
    for (const ToolSample& tool : theatre.tools) {
      ASSERT_LT(tool.tool, 2U) << "a grasper that is not sent is not missing";
      ASSERT_LE(tool.source_time, tool.arrival);
      ASSERT_LT(tool.arrival - tool.source_time, milliseconds(3));
      ++count[tool.tool];
      if (tool.tool == 0) {
        ASSERT_LT((tool.X_WS.t - kReference.t).norm(), 1e-3);
        continue;
      }
      if (count[1] == 1 && tool.state != ToolState::kOk) continue;  // sent before the first reference
      ASSERT_EQ(tool.state, ToolState::kOk);
      ASSERT_LT((tool.X_WS * kTip - tip_W).norm(), 1e-2);
    }
    EXPECT_NEAR(static_cast<double>(count[0]), 200.0, 2.0);
    EXPECT_NEAR(static_cast<double>(count[1]), 200.0, 2.0);
  }
}

TEST(IgtlTools, OneThatTdataLeavesOutIsMissingFromWhenItCame) {
  const auto until_2_s = [] {
    std::vector<TrackerSample> samples;
    for (int i = 0; i < 100; ++i) {
      TrackerSample sample;
      sample.source_time = kStart + i * milliseconds(20);
      sample.state = ToolState::kOk;
      samples.push_back(sample);
    }
    return PoseTrack::of_samples(kStart, samples);
  };
  IgtlTheatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}, .tools = {"Pointer"}},
                      {.message = Message::kTdata, .others = {{"Pointer", until_2_s()}}});
  theatre.run(seconds(3));
  ASSERT_GT(theatre.tools.size(), 140U);
  for (std::size_t i = 0; i < theatre.tools.size(); ++i) {
    EXPECT_EQ(theatre.tools[i].state, i < 100 ? ToolState::kOk : ToolState::kMissing) << i;
  }
}

TEST(IgtlTools, WithoutASensorsNameItIsTheOneThatIsNoOthers) {
  IgtlTheatre theatre({.sensor = "", .reference = "Patient", .world = {}, .tools = {"Pointer"}},
                      {.others = {{"Patient", PoseTrack::still(kStart, kReference)},
                                  {"Pointer", PoseTrack::still(kStart, kReference)}}});
  theatre.run(seconds(1));
  EXPECT_EQ(theatre.host.failure, "");
  EXPECT_GT(theatre.samples.size(), 40U);
}

TEST(IgtlStamps, ThatAreWrongGiveNoPoseAndAreToldByName) {
  struct Case {
    Stamps stamps;
    double clock_rate;
    const char* fault;
  };
  const Case cases[] = {{Stamps::kMilliseconds, 1.0, "milliseconds where seconds belong"},
                        {Stamps::kMicroseconds, 1.0, "microseconds where seconds belong"},
                        {Stamps::kWholeSeconds, 1.0, "whole seconds"},
                        {Stamps::kNanosecondFraction, 1.0, "fractions of a second in nanoseconds"},
                        {Stamps::kCounts, 1.0, "counts, such as frame numbers, 50 a second"},
                        {Stamps::kSeconds, 0.5, "of a clock that runs at 0.5 of ours"}};
  for (const Message message : {Message::kTransform, Message::kTdata}) {
    for (const Case& c : cases) {
      SCOPED_TRACE(c.fault);
      IgtlTheatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}, .tools = {"Pointer"}},
                          {.message = message,
                           .others = {{"Pointer", PoseTrack::still(kStart, kReference)}},
                           .stamps = c.stamps,
                           .clock_rate = c.clock_rate});
      theatre.run(seconds(5));
      EXPECT_EQ(theatre.host.failure, "");
      EXPECT_EQ(theatre.health.state(), DeviceState::kSilent);
      EXPECT_THAT(theatre.health.reason(), HasSubstr(std::string("the server's stamps are ") + c.fault));
      EXPECT_THAT(theatre.health.reason(), HasSubstr("tracker.igtl_stamps"));
      for (const TrackerSample& sample : theatre.samples) {
        EXPECT_EQ(sample.source_time, sample.arrival) << "no stamp was used";
        EXPECT_EQ(sample.state, ToolState::kOk);
        EXPECT_LT(sample.arrival, kStart + milliseconds(1400));
      }
      for (const ToolSample& sample : theatre.tools) EXPECT_EQ(sample.source_time, sample.arrival);
    }
  }
}

TEST(IgtlStamps, ThatAreNotLookedAtHarmNothing) {
  for (const Stamps stamps : {Stamps::kWholeSeconds, Stamps::kMilliseconds, Stamps::kNone}) {
    IgtlTheatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}, .stamps_by_arrival = true},
                        {.stamps = stamps});
    theatre.run(seconds(4));
    EXPECT_EQ(theatre.health.state(), DeviceState::kStreaming);
    EXPECT_EQ(theatre.health.reason(), "");
    EXPECT_NEAR(static_cast<double>(theatre.samples.size()), 200.0, 2.0);
    for (const TrackerSample& sample : theatre.samples) EXPECT_EQ(sample.source_time, sample.arrival);
  }
}

}  // namespace
}  // namespace perimap
