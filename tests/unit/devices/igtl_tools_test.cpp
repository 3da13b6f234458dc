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

// A server that holds the last pose, and its stamp, while the tool is out of sight.
TEST(IgtlStamps, APoseThatIsRepeatedIsNoNewOneWhateverStampsAreGoodFor) {
  for (const bool by_arrival : {false, true}) {
    SCOPED_TRACE(by_arrival);
    std::vector<TrackerSample> samples;
    DeviceHealth health;
    IgtlSession session(
        {.sensor = "Scope", .reference = "Patient", .world = {}, .stamps_by_arrival = by_arrival},
        [&samples](const TrackerSample& sample) { samples.push_back(sample); }, health);
    ScriptedLink link;
    session.on_open(link, kStart);
    const auto say = [&](const char* name, const Pose& X, std::uint64_t stamp, Instant arrival) {
      session.on_bytes(link, encode_igtl({1, "TRANSFORM", name, stamp, encode_igtl_transform(X), {}}), arrival);
    };
    const auto stamp = [](int i) { return (1ULL << 32U) + static_cast<std::uint64_t>(i) * 85899346U; };  // 20 ms
    const auto moved = [](int i) { return Pose{Matrix3d::Identity(), Vector3d(i, 0, 0)}; };
    for (const char* frozen : {"Scope", "Patient"}) {
      samples.clear();
      const int begin = frozen[0] == 'S' ? 0 : 300;
      for (int i = begin; i < begin + 150; ++i) {
        const Instant now = kStart + i * milliseconds(20);
        const int held = std::min(i, begin + 100);
        const int patient = frozen[0] == 'P' ? held : i;
        const int scope = frozen[0] == 'S' ? held : i;
        say("Patient", moved(-patient), stamp(patient), now);
        say("Scope", moved(scope), stamp(scope), now);
      }
      ASSERT_GT(samples.size(), 100U);
      EXPECT_EQ(samples.back().state, ToolState::kMissing);
      EXPECT_EQ(health.reason(), "") << "a tool out of sight is no fault of the server's";
      for (const TrackerSample& sample : samples) {
        const bool fresh = sample.arrival <= kStart + (begin + 100) * milliseconds(20) + milliseconds(110);
        EXPECT_TRUE(fresh || sample.state != ToolState::kOk) << frozen;
      }
    }
  }
}

}  // namespace
}  // namespace perimap
