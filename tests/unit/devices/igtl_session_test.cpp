// Sessions with an OpenIGTLink server.
#include "igtl_theatre.hpp"

namespace perimap {
namespace {

TEST(IgtlSession, GivesEveryPoseByTransformTdataAndPosition) {
  using Message = IgtlEmulatorSettings::Message;
  for (const Message message : {Message::kTransform, Message::kTdata, Message::kPosition}) {
    for (const unsigned version : {1U, 2U}) {
      SCOPED_TRACE(static_cast<int>(message));
      EmulatorFaults drifting;
      drifting.drift_ppm = 200.0;
      IgtlTheatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}}, {message, version, "Scope"},
                          drifting);
      theatre.run(seconds(4));
      ASSERT_EQ(theatre.host.failure, "");
      EXPECT_THAT(theatre.host.sent, HasSubstr("STT_TDATA"));
      ASSERT_NEAR(static_cast<double>(theatre.samples.size()), 200.0, 2.0);
      for (std::size_t i = 0; i < theatre.samples.size(); ++i) {
        const TrackerSample& sample = theatre.samples[i];
        ASSERT_EQ(sample.state, ToolState::kOk);
        ASSERT_LT((sample.X_WS.t - IgtlTheatre::track().at(static_cast<std::int64_t>(i)).X_TO.t).norm(), 1e-3);
        ASSERT_LE(sample.source_time, sample.arrival);
        ASSERT_LT(sample.arrival - sample.source_time, milliseconds(3));
      }
    }
  }
}

TEST(IgtlSession, TellsWhosePosesTheServerSends) {
  DeviceHealth health;
  IgtlSession session(
      {.sensor = "Scope", .reference = std::nullopt, .world = {}}, [](const TrackerSample&) {}, health);
  ScriptedLink link;
  session.on_open(link, kStart);
  EXPECT_EQ(health.identity(), "");
  for (const char* name : {"Probe", "Scope", "Probe"}) {
    session.on_bytes(link, encode_igtl({1, "TRANSFORM", name, 1ULL << 32U, encode_igtl_transform(kPose), {}}), kStart);
  }
  EXPECT_EQ(health.identity(), "sends poses of Probe, Scope");
}

TEST(IgtlSession, NotesPosesWithoutStampsOnceUnlessArrivalsAreAskedFor) {
  for (const bool by_arrival : {false, true}) {
    for (const bool stamped : {false, true}) {
      DeviceHealth health;
      std::size_t samples = 0;
      IgtlSession session(
          {.sensor = "Scope", .reference = std::nullopt, .world = {}, .stamps_by_arrival = by_arrival},
          [&](const TrackerSample&) { ++samples; }, health);
      ScriptedLink link;
      session.on_open(link, kStart);
      Pose X = kPose;
      for (std::uint64_t i = 1; i <= 3; ++i) {
        X.t.x() += 0.1;  // another reading
        session.on_bytes(link,
                         encode_igtl({1, "TRANSFORM", "Scope", stamped ? i << 32U : 0, encode_igtl_transform(X), {}}),
                         kStart + seconds(i));
      }
      EXPECT_EQ(samples, 3U);
      EXPECT_EQ(health.notice().find("without time stamps") != std::string::npos, !stamped && !by_arrival);
    }
  }
}

TEST(IgtlSession, NotesNoMissingStampsAnyMoreOnceTheyCome) {
  DeviceHealth health;
  IgtlSession session(
      {.sensor = "Scope", .reference = std::nullopt, .world = {}}, [](const TrackerSample&) {}, health);
  ScriptedLink link;
  session.on_open(link, kStart);
  Pose X = kPose;
  const auto send = [&](int i, bool stamped) {
    X.t.x() += 0.1;
    const std::uint64_t stamp = (1ULL << 32U) + static_cast<std::uint64_t>(i) * 85899346U;  // 20 ms
    session.on_bytes(link, encode_igtl({1, "TRANSFORM", "Scope", stamped ? stamp : 0, encode_igtl_transform(X), {}}),
                     kStart + milliseconds(20 * i));
  };
  // A stamp now and then is none.
  for (int i = 0; i < 100; ++i) send(i, i % 3 == 0);
  EXPECT_THAT(health.notice(), testing::HasSubstr("without time stamps"));
  for (int i = 100; i < 200; ++i) send(i, true);
  EXPECT_EQ(health.notice(), "");
  send(200, false);
  EXPECT_THAT(health.notice(), testing::HasSubstr("without time stamps"));
}

TEST(IgtlSession, AToolLeftOutOfTdataOrMarkedSoIsMissing) {
  using Message = IgtlEmulatorSettings::Message;
  EmulatorFaults faults;
  faults.missing_every = seconds(1);
  faults.missing_for = milliseconds(300);
  for (const auto& [message, version] : {std::pair{Message::kTdata, 1U}, std::pair{Message::kTransform, 2U}}) {
    IgtlTheatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}}, {message, version, "Scope"},
                        faults);
    theatre.run(seconds(2));
    ASSERT_GT(theatre.samples.size(), 95U);
    for (std::size_t i = 0; i < theatre.samples.size(); ++i) {
      EXPECT_EQ(theatre.samples[i].state == ToolState::kMissing, i % 50 >= 35) << i;
    }
  }
}

TEST(IgtlSession, OtherToolsAreNotTheSensor) {
  IgtlTheatre theatre({.sensor = "Probe", .reference = std::nullopt, .world = {}}, {});
  theatre.run(seconds(5));
  EXPECT_TRUE(theatre.samples.empty());
  EXPECT_EQ(theatre.health.reason(), "no tool 'Probe' in 2 s; the server sends Scope");
}

TEST(IgtlSession, WhatTheServerComplainsOfIsTheReasonWhenNoPoseComes) {
  for (const bool recovered : {false, true}) {
    DeviceHealth health;
    IgtlSession session(
        {.sensor = "Scope", .reference = std::nullopt, .world = {}}, [](const TrackerSample&) { FAIL(); }, health);
    ScriptedLink link;
    session.on_open(link, kStart);
    const auto status = [&](std::uint8_t code) {
      std::vector<std::byte> content(30);
      content[1] = static_cast<std::byte>(code);
      const std::string_view name = "no camera";
      std::transform(name.begin(), name.end(), content.begin() + 10, [](char c) { return static_cast<std::byte>(c); });
      session.on_bytes(link, encode_igtl({1, "STATUS", "Server", 0, content, {}}), kStart + milliseconds(10));
    };
    status(13);
    if (recovered) status(1);
    session.on_time(link, kStart + seconds(2));
    EXPECT_EQ(link.failure, "") << "the server spoke 1.99 s ago";
    session.on_time(link, session.next_time());
    for (const std::string& told : {health.reason(), link.failure}) {
      EXPECT_THAT(told, HasSubstr("no pose of any tool"));
      EXPECT_EQ(told.find("Server reports status 13 no camera") != std::string::npos, !recovered);
    }
  }
}

TEST(IgtlSession, MeasuresRelativeToTheReferenceWhileThatIsFresh) {
  std::vector<TrackerSample> samples;
  DeviceHealth health;
  IgtlSession session(
      {.sensor = "Scope", .reference = "Patient", .world = {}},
      [&samples](const TrackerSample& sample) { samples.push_back(sample); }, health);
  ScriptedLink link;
  session.on_open(link, kStart);
  const Pose X_TR{so3_exp(Vector3d(0, 0.2, 0)), Vector3d(1, 2, 3)};
  const auto say = [&](const std::string& name, const Pose& X, std::uint64_t stamp, Instant arrival) {
    session.on_bytes(link, encode_igtl({1, "TRANSFORM", name, stamp, encode_igtl_transform(X), {}}), arrival);
  };
  say("Patient", X_TR, 1ULL << 32U, kStart - milliseconds(200));
  say("Scope", kPose, (1ULL << 32U) + (1ULL << 30U), kStart);
  say("Patient", X_TR, 2ULL << 32U, kStart + milliseconds(10));
  say("Scope", kPose, 2ULL << 32U, kStart + milliseconds(11));
  say("Scope", kPose, 3ULL << 32U, kStart + milliseconds(500));
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[0].state, ToolState::kMissing);
  EXPECT_EQ(samples[1].state, ToolState::kOk);
  EXPECT_LT((samples[1].X_WS.t - (X_TR.inverse() * kPose).t).norm(), 1e-5);
  EXPECT_EQ(samples[2].state, ToolState::kMissing);
}

// A session without a transport that is sent message by message.
struct Listener {
  explicit Listener(IgtlSettings settings)
      : session(
            std::move(settings), [this](const TrackerSample& sample) { samples.push_back(sample); }, health) {
    session.on_open(link, kStart);
  }
  void send(const std::string& type, const std::string& name, const std::vector<std::byte>& content, Duration at,
            std::uint64_t stamp = 0) {
    session.on_bytes(link, encode_igtl({1, type, name, stamp, content, {}}), kStart + at);
  }
  void transform(const std::string& name, Duration at, const Pose& X = kPose, std::uint64_t stamp = 0) {
    send("TRANSFORM", name, encode_igtl_transform(X), at, stamp);
  }
  void let_time_pass(Duration until) {
    while (link.failure.empty() && session.next_time() <= kStart + until) {
      const Instant next = session.next_time();
      session.on_time(link, next);
      ASSERT_TRUE(!link.failure.empty() || session.next_time() > next) << "it would be called without end";
    }
  }

  std::vector<TrackerSample> samples;
  DeviceHealth health;
  ScriptedLink link;
  IgtlSession session;
};

// A patient that moves by 10 mm a cycle, sent after the scope and before it, with stamps alike or almost.
TEST(IgtlSession, APoseIsRelativeToTheReferenceOfItsOwnInstantWhicheverIsSentFirst) {
  for (const bool scope_first : {true, false}) {
    for (const std::uint64_t between : {0U, 1000000U}) {  // 0.23 ms
      SCOPED_TRACE(scope_first);
      Listener listener({.sensor = "Scope", .reference = "Patient", .world = {}});
      for (int i = 0; i < 50; ++i) {
        const std::uint64_t stamp = (1ULL << 32U) + static_cast<std::uint64_t>(i) * 85899346U;  // 20 ms
        const Pose X_TR{Matrix3d::Identity(), Vector3d(10.0 * i, 0, 0)};
        const Duration at = milliseconds(20 * i);
        const std::size_t given = listener.samples.size();
        const bool awaited = i == 0 && scope_first;
        if (scope_first) listener.transform("Scope", at, kPose, stamp);
        listener.transform("Patient", at + milliseconds(1), X_TR, stamp + between);
        if (!scope_first) listener.transform("Scope", at + milliseconds(2), kPose, stamp);
        ASSERT_EQ(listener.samples.size(), given + (awaited ? 0 : 1)) << "nothing before the first reference";
        if (awaited) continue;
        const TrackerSample& sample = listener.samples.back();
        ASSERT_EQ(sample.state, ToolState::kOk);
        EXPECT_NEAR(sample.X_WS.t[0], kPose.t[0] - 10.0 * i, 1e-3);
        EXPECT_EQ(sample.arrival, kStart + at + milliseconds(scope_first ? 0 : 2));
      }
    }
  }
}

TEST(IgtlSession, AReferenceThatStaysAwayHoldsUpOnePoseForTwentyMilliseconds) {
  Listener listener({.sensor = "Scope", .reference = "Patient", .world = {}});
  const auto stamp = [](int i) { return (1ULL << 32U) + static_cast<std::uint64_t>(i) * 85899346U; };
  for (int i = 0; i < 10; ++i) {
    listener.transform("Scope", milliseconds(20 * i), kPose, stamp(i));
    listener.transform("Patient", milliseconds(20 * i + 1), Pose{}, stamp(i));
  }
  ASSERT_EQ(listener.samples.size(), 9U) << "the first came before any reference";
  listener.transform("Scope", milliseconds(200), kPose, stamp(10));
  EXPECT_EQ(listener.samples.size(), 9U);
  EXPECT_EQ(listener.session.next_time(), kStart + milliseconds(220));
  listener.session.on_time(listener.link, kStart + milliseconds(220));
  ASSERT_EQ(listener.samples.size(), 10U);
  EXPECT_EQ(listener.samples.back().state, ToolState::kOk) << "the last reference is 20 ms old";
  EXPECT_EQ(listener.health.state(), DeviceState::kStreaming);
  for (int i = 11; i < 20; ++i) {
    listener.transform("Scope", milliseconds(20 * i), kPose, stamp(i));
    ASSERT_EQ(listener.samples.size(), static_cast<std::size_t>(i));
    EXPECT_EQ(listener.samples.back().state, i < 15 ? ToolState::kOk : ToolState::kMissing) << i;
  }
}

TEST(IgtlSession, WithoutANameASecondToolIsRefusedAndNotTakenForTheFirst) {
  Listener listener({.sensor = "", .reference = std::nullopt, .world = {}});
  listener.transform("Scope", milliseconds(10));
  EXPECT_EQ(listener.samples.size(), 1U);
  auto together = encode_igtl({1, "TRANSFORM", "Patient", 0, encode_igtl_transform(kPose), {}});
  const auto behind = encode_igtl({1, "TRANSFORM", "Scope", 0, encode_igtl_transform(kPose), {}});
  together.insert(together.end(), behind.begin(), behind.end());
  listener.session.on_bytes(listener.link, together, kStart + milliseconds(11));
  EXPECT_EQ(listener.samples.size(), 1U);
  EXPECT_THAT(listener.link.failure, HasSubstr("several tools ('Scope', 'Patient'): say which one"));
  // Opened anew, whichever comes first is no sooner the sensor.
  listener.link.failure.clear();
  listener.session.on_open(listener.link, kStart + seconds(1));
  listener.transform("Patient", milliseconds(1010));
  listener.transform("Scope", milliseconds(1011));
  EXPECT_EQ(listener.samples.size(), 1U);
  EXPECT_THAT(listener.link.failure, HasSubstr("several tools"));
  // The server has been told to send one alone.
  listener.link.failure.clear();
  listener.session.on_open(listener.link, kStart + seconds(2));
  for (int i = 0; i <= 10; ++i) listener.transform("Scope", milliseconds(2000 + 110 * i));
  EXPECT_EQ(listener.link.failure, "");
  EXPECT_EQ(listener.samples.size(), 2U);
}

TEST(IgtlSession, WithoutANameTdataMustHoldOneToolBesideTheReference) {
  const Pose X_TR{so3_exp(Vector3d(0, 0.2, 0)), Vector3d(1, 2, 3)};
  const auto tdata = [](std::vector<IgtlTool> tools) { return encode_igtl_tdata(tools); };
  Listener listener({.sensor = "", .reference = "Patient", .world = {}});
  listener.send("TDATA", "Tracker", tdata({{"Patient", X_TR}}), milliseconds(10));
  EXPECT_EQ(listener.samples.size(), 0U) << "the reference is not the sensor";
  listener.send("TDATA", "Tracker", tdata({{"Patient", X_TR}, {"Scope", kPose}}), milliseconds(20));
  ASSERT_EQ(listener.samples.size(), 1U);
  EXPECT_LT((listener.samples[0].X_WS.t - (X_TR.inverse() * kPose).t).norm(), 1e-5);
  listener.send("TDATA", "Tracker", tdata({{"Scope", kPose}, {"Pointer", X_TR}}), milliseconds(30));
  EXPECT_EQ(listener.samples.size(), 1U);
  EXPECT_THAT(listener.link.failure, HasSubstr("several tools ('Scope', 'Pointer')"));
}

TEST(IgtlSession, AToolThatNeverCameIsAwaitedAndNotMissing) {
  const std::vector<IgtlTool> sent{{"Probe", kPose}, {"Patient", kPose}};
  struct Case {
    const char* sensor;
    std::optional<std::string> reference;
    const char* reason;
  };
  const Case cases[] = {
      {"Wrong", std::nullopt, "no tool 'Wrong' in 2 s; the server sends Probe, Patient"},
      {"Probe", "Wrong", "no tool 'Wrong' in 2 s; the server sends Probe, Patient"},
      {"Wrong", "Other",
       "no tool 'Wrong' and no tool 'Other' in 2 s; the server sends Probe, "
       "Patient"},
  };
  for (const bool tdata : {true, false}) {
    for (const Case& c : cases) {
      SCOPED_TRACE(c.reason);
      Listener listener({.sensor = c.sensor, .reference = c.reference, .world = {}});
      listener.health.set_state(DeviceState::kStarting);
      for (int i = 0; i < 500; ++i) {
        const Duration at = milliseconds(10 * i);
        if (tdata) {
          listener.send("TDATA", "Tracker", encode_igtl_tdata(sent), at,
                        (1ULL << 32U) + static_cast<std::uint64_t>(i) * 42949673U);
        } else {
          for (const IgtlTool& tool : sent) listener.transform(tool.name, at);
        }
        listener.let_time_pass(at);
        ASSERT_EQ(listener.health.reason(), i < 200 ? "" : c.reason);
      }
      EXPECT_TRUE(listener.samples.empty());
      EXPECT_EQ(listener.health.state(), DeviceState::kStarting);
      EXPECT_EQ(listener.link.failure, "");
    }
  }
}

TEST(IgtlSession, AToolThatComesLateIsMissingOnlyFromThenOnAndAwaitedAgainInTheNextConnection) {
  const auto tdata = [](std::vector<IgtlTool> tools) { return encode_igtl_tdata(tools); };
  Listener listener({.sensor = "Scope", .reference = "Patient", .world = {}});
  for (int i = 0; i < 300; ++i) {
    listener.send("TDATA", "Tracker", tdata({{"Patient", kPose}}), milliseconds(10 * i));
    listener.let_time_pass(milliseconds(10 * i));
  }
  EXPECT_TRUE(listener.samples.empty());
  EXPECT_THAT(listener.health.reason(), HasSubstr("no tool 'Scope'"));
  listener.send("TDATA", "Tracker", tdata({{"Patient", kPose}, {"Scope", kPose}}), milliseconds(3000));
  listener.send("TDATA", "Tracker", tdata({{"Patient", kPose}}), milliseconds(3010));
  listener.send("TDATA", "Tracker", tdata({{"Scope", kPose}}), milliseconds(3020));
  ASSERT_EQ(listener.samples.size(), 3U);
  EXPECT_EQ(listener.samples[0].state, ToolState::kOk);
  EXPECT_EQ(listener.samples[1].state, ToolState::kMissing);
  EXPECT_EQ(listener.samples[2].state, ToolState::kMissing);
  EXPECT_EQ(listener.health.state(), DeviceState::kStreaming);
  EXPECT_EQ(listener.health.reason(), "");
  listener.session.on_open(listener.link, kStart + seconds(4));
  listener.send("TDATA", "Tracker", tdata({{"Patient", kPose}}), milliseconds(4010));
  listener.send("TDATA", "Tracker", tdata({{"Scope", kPose}}), milliseconds(4020));
  ASSERT_EQ(listener.samples.size(), 4U) << "each tool has been seen, though not at once";
  EXPECT_EQ(listener.samples[3].state, ToolState::kMissing);
}

TEST(IgtlSession, ASensorThatGoesBeforeTheReferenceComesIsMissing) {
  Listener listener({.sensor = "Scope", .reference = "Patient", .world = {}});
  listener.transform("Scope", milliseconds(0));
  for (int i = 0; i < 200; ++i) {
    const Duration at = milliseconds(1000 + 20 * i);
    listener.let_time_pass(at);
    listener.transform("Patient", at);
  }
  EXPECT_GE(listener.samples.size(), 18U);
  for (const TrackerSample& sample : listener.samples) EXPECT_EQ(sample.state, ToolState::kMissing);
  EXPECT_EQ(listener.health.state(), DeviceState::kStreaming);
  EXPECT_EQ(listener.health.reason(), "");
}

TEST(IgtlSession, AReferenceThatComesLateMakesNoPoseMissing) {
  Listener listener({.sensor = "Scope", .reference = "Patient", .world = {}});
  for (int i = 0; i < 100; ++i) {
    listener.transform("Scope", milliseconds(20 * i));
    if (i >= 50) listener.transform("Patient", milliseconds(20 * i + 1));
  }
  EXPECT_EQ(listener.samples.size(), 49U);
  for (const TrackerSample& sample : listener.samples) EXPECT_EQ(sample.state, ToolState::kOk);
}

// Header 1: what is out of sight is not sent.
TEST(IgtlSession, AToolOutOfSightIsMissingWhileAnythingElseComes) {
  std::vector<std::byte> well(30);
  well[1] = std::byte{1};
  struct Case {
    const char* type;
    const char* name;
    std::vector<std::byte> content;
    Duration every;
    std::size_t least;  // readings in 10 s
    std::size_t most;
  };
  const Case cases[] = {
      {"TRANSFORM", "Patient", encode_igtl_transform(kPose), milliseconds(20), 45, 50},
      {"TDATA", "Tracker", encode_igtl_tdata(std::vector<IgtlTool>{{"Patient", kPose}}), milliseconds(20), 500, 501},
      {"STATUS", "Server", well, seconds(1), 9, 11},
      {"IMAGE", "Ultrasound", std::vector<std::byte>(500), milliseconds(100), 45, 51},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.type);
    Listener listener({.sensor = "Scope", .reference = "Patient", .world = {}});
    listener.transform("Patient", milliseconds(0));
    listener.transform("Scope", milliseconds(10));
    ASSERT_EQ(listener.samples.size(), 1U);
    Duration at = milliseconds(10);
    while (at < seconds(10)) {
      at += c.every;
      listener.let_time_pass(at);
      listener.send(c.type, c.name, c.content, at);
      ASSERT_EQ(listener.link.failure, "");
      ASSERT_TRUE(at <= seconds(2) || listener.health.state() == DeviceState::kStreaming);
    }
    EXPECT_GE(listener.samples.size(), 1 + c.least);
    EXPECT_LE(listener.samples.size(), 1 + c.most);
    for (std::size_t i = 1; i < listener.samples.size(); ++i) {
      ASSERT_EQ(listener.samples[i].state, ToolState::kMissing);
      ASSERT_GT(listener.samples[i].source_time, listener.samples[i - 1].source_time);
    }
    // Back in sight, over the same link.
    listener.transform("Patient", at + milliseconds(1));
    listener.transform("Scope", at + milliseconds(2));
    EXPECT_EQ(listener.samples.back().state, ToolState::kOk);
    // Nothing at all.
    listener.let_time_pass(at + milliseconds(301));
    EXPECT_EQ(listener.health.state(), DeviceState::kStreaming);
    listener.let_time_pass(at + milliseconds(302));
    EXPECT_EQ(listener.health.state(), DeviceState::kSilent);
    listener.let_time_pass(at + milliseconds(2001));
    EXPECT_EQ(listener.link.failure, "");
    listener.let_time_pass(at + milliseconds(2002));
    EXPECT_THAT(listener.link.failure, HasSubstr("nothing came for 2 s"));
  }
}

TEST(IgtlSession, ATrackedToolIsNeverMissingBetweenTwoOfItsPoses) {
  Listener listener({.sensor = "Scope", .reference = "Patient", .world = {}});
  for (int i = 0; i < 500; ++i) {
    listener.transform("Patient", milliseconds(10 * i));
    listener.transform("Pointer", milliseconds(10 * i + 1));
    if (i % 10 == 0) listener.transform("Scope", milliseconds(10 * i + 2));
  }
  EXPECT_EQ(listener.samples.size(), 50U);
  for (const TrackerSample& sample : listener.samples) EXPECT_EQ(sample.state, ToolState::kOk);
}

TEST(IgtlSession, AServerWhoseMessagesAreAllDamagedIsGivenUp) {
  Listener listener({.sensor = "Scope", .reference = std::nullopt, .world = {}});
  listener.transform("Scope", milliseconds(0));
  auto damaged = encode_igtl({1, "TRANSFORM", "Scope", 0, encode_igtl_transform(kPose), {}});
  damaged.back() ^= std::byte{1};
  for (int i = 1; i < 250; ++i) {
    listener.session.on_bytes(listener.link, damaged, kStart + milliseconds(10 * i));
    listener.let_time_pass(milliseconds(10 * i));
    ASSERT_EQ(listener.link.failure.empty(), i < 200);
  }
  EXPECT_EQ(listener.samples.size(), 1U);
}

TEST(IgtlSession, DamagedMessagesGiveNoPose) {
  EmulatorFaults faults;
  faults.bad_check = 0.05;
  faults.lost = 0.05;
  IgtlTheatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}}, {}, faults);
  theatre.run(seconds(20));
  EXPECT_GT(theatre.health.damaged.get(), 20U);
  EXPECT_GT(theatre.samples.size(), 800U);
  for (const TrackerSample& sample : theatre.samples) {
    double nearest = 1e9;
    const auto frame = (sample.arrival - kStart) / milliseconds(20);
    for (std::int64_t near = frame - 1; near <= frame + 1; ++near) {
      nearest = std::min(nearest, (sample.X_WS.t - IgtlTheatre::track().at(near).X_TO.t).norm());
    }
    EXPECT_LT(nearest, 1e-3);
  }
}

}  // namespace
}  // namespace perimap
