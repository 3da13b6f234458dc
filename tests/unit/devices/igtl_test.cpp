// OpenIGTLink: framing, decoding, sessions with the emulated server, and messages exchanged with Debian's library.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <igtlPositionMessage.h>
#include <igtlStatusMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "drivers/standins/emulator/igtl_emulator.hpp"
#include "drivers/tracker/igtl_message.hpp"
#include "drivers/tracker/igtl_session.hpp"
#include "scripted_link.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

const Instant kStart(seconds(100));
const Pose kPose{so3_exp(Vector3d(0.3, -0.4, 0.5)), Vector3d(10, -20, 30)};

void expect_pose(const Expected<Pose>& pose) {
  ASSERT_TRUE(pose) << pose.error().message;
  EXPECT_LT((pose->R - kPose.R).norm(), 1e-6);
  EXPECT_LT((pose->t - kPose.t).norm(), 1e-5);
}

IgtlMessage transform(unsigned version = 1) {
  return {version, "TRANSFORM", "Scope", 5ULL << 32U, encode_igtl_transform(kPose), {}};
}

std::string kind_of(IgtlFramer& framer) {
  const auto next = framer.next();
  if (!next) return "more";
  if (const auto* message = std::get_if<IgtlMessage>(&*next)) return message->type;
  return std::get<IgtlDamaged>(*next).lost_track ? "lost" : "damaged";
}

// ---- Debian's library as the peer

void set_matrix(igtl::Matrix4x4& matrix) {
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      matrix[row][column] = static_cast<float>(row == 3      ? (column == 3 ? 1 : 0)
                                               : column == 3 ? kPose.t[row]
                                                             : kPose.R(row, column));
    }
  }
}

IgtlMessage framed_of(igtl::MessageBase& message) {
  message.Pack();
  IgtlFramer framer;
  framer.feed(
      {static_cast<const std::byte*>(message.GetPackPointer()), static_cast<std::size_t>(message.GetPackSize())});
  const auto next = framer.next();
  EXPECT_TRUE(next && std::holds_alternative<IgtlMessage>(*next));
  return next && std::holds_alternative<IgtlMessage>(*next) ? std::get<IgtlMessage>(*next) : IgtlMessage{};
}

TEST(IgtlLibrary, WhatItSendsIsUnderstood) {
  igtl::Matrix4x4 matrix;
  set_matrix(matrix);
  auto sent = igtl::TransformMessage::New();
  sent->SetDeviceName("Scope");
  sent->SetMatrix(matrix);
  auto stamp = igtl::TimeStamp::New();
  stamp->SetTime(1234, 500000000);
  sent->SetTimeStamp(stamp);
  const IgtlMessage message = framed_of(*sent);
  EXPECT_EQ(message.device, "Scope");
  EXPECT_NEAR(static_cast<double>(message.time_ns()), 1234.5e9, 10);
  expect_pose(decode_igtl_transform(message.content));

  auto tracking = igtl::TrackingDataMessage::New();
  auto element = igtl::TrackingDataElement::New();
  element->SetName("Scope");
  element->SetType(igtl::TrackingDataElement::TYPE_6D);
  element->SetMatrix(matrix);
  tracking->AddTrackingDataElement(element);
  const auto tools = decode_igtl_tdata(framed_of(*tracking).content);
  ASSERT_TRUE(tools);
  ASSERT_EQ(tools->size(), 1U);
  EXPECT_EQ(tools->front().name, "Scope");
  expect_pose(tools->front().X_TO);

  auto position = igtl::PositionMessage::New();
  position->SetPosition(10, -20, 30);
  double q[4];
  rotation_to_wxyz(kPose.R, q);
  position->SetQuaternion(static_cast<float>(q[1]), static_cast<float>(q[2]), static_cast<float>(q[3]),
                          static_cast<float>(q[0]));
  expect_pose(decode_igtl_position(framed_of(*position).content));
  position->SetPackType(igtl::PositionMessage::WITH_QUATERNION3);
  const IgtlMessage shorter = framed_of(*position);
  EXPECT_EQ(shorter.content.size(), 24U);
  expect_pose(decode_igtl_position(shorter.content));

  auto status = igtl::StatusMessage::New();
  status->SetCode(igtl::StatusMessage::STATUS_NOT_READY);
  status->SetErrorName("E13");
  status->SetStatusString("warming up");
  const auto told = decode_igtl_status(framed_of(*status).content);
  ASSERT_TRUE(told);
  EXPECT_EQ(told->code, 13U);
  EXPECT_EQ(told->text, "warming up");
}

TEST(IgtlLibrary, UnderstandsWhatIsSent) {
  const auto bytes = encode_igtl(transform());
  auto header = igtl::MessageHeader::New();
  header->InitPack();
  ASSERT_EQ(header->GetPackSize(), 58);
  std::memcpy(header->GetPackPointer(), bytes.data(), 58);
  header->Unpack();
  EXPECT_STREQ(header->GetDeviceName(), "Scope");
  auto received = igtl::TransformMessage::New();
  received->SetMessageHeader(header);
  received->AllocatePack();
  std::memcpy(received->GetPackBodyPointer(), bytes.data() + 58, bytes.size() - 58);
  ASSERT_TRUE(received->Unpack(1) & igtl::MessageHeader::UNPACK_BODY);  // with its own check of the CRC
  igtl::Matrix4x4 matrix;
  received->GetMatrix(matrix);
  EXPECT_NEAR(matrix[2][3], 30.0F, 1e-5);
  EXPECT_NEAR(matrix[0][1], kPose.R(0, 1), 1e-6);
}

// ---- framing and decoding

TEST(IgtlFramer, TakesBothHeaderVersionsInAnyChunksAndPassesOverOtherTypes) {
  std::vector<std::byte> stream;
  const auto append = [&stream](const IgtlMessage& message) {
    const auto bytes = encode_igtl(message);
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  };
  append(transform(1));
  append({1, "IMAGE", "Ultrasound", 0, std::vector<std::byte>(5000, std::byte{0x42}), {}});
  IgtlMessage second = transform(2);
  second.metadata = {{"TransformStatus", "OK"}, {"x", ""}};
  append(second);
  append({1, "SOMETHING", "", 0, {}, {}});
  append(transform(1));
  for (const std::size_t cut : {std::size_t{1}, std::size_t{57}, std::size_t{58}, std::size_t{700}, stream.size()}) {
    IgtlFramer framer;
    std::vector<IgtlMessage> messages;
    for (std::size_t at = 0; at < stream.size(); at += cut) {
      framer.feed(std::span(stream).subspan(at, std::min(cut, stream.size() - at)));
      while (const auto next = framer.next()) {
        ASSERT_TRUE(std::holds_alternative<IgtlMessage>(*next));
        messages.push_back(std::get<IgtlMessage>(*next));
      }
    }
    ASSERT_EQ(messages.size(), 3U);
    for (const IgtlMessage& message : messages) expect_pose(decode_igtl_transform(message.content));
    EXPECT_EQ(messages[1].metadata, second.metadata);
  }
}

TEST(IgtlFramer, DamageIsNoticedAndOnlyABadHeaderLosesTrack) {
  const auto good = encode_igtl(transform());
  for (std::size_t at = 58; at < good.size(); ++at) {
    auto bad = good;
    bad[at] ^= std::byte{0x04};
    bad.insert(bad.end(), good.begin(), good.end());
    IgtlFramer framer;
    framer.feed(bad);
    EXPECT_EQ(kind_of(framer), "damaged");
    EXPECT_EQ(kind_of(framer), "TRANSFORM");
  }
  struct Case {
    const char* what;
    std::size_t at;
    std::uint8_t value;
    const char* kind;
  };
  const Case cases[] = {{"version 0", 1, 0, "lost"},
                        {"version 3", 1, 3, "lost"},
                        {"type not printable", 2, 1, "lost"},
                        {"no type", 2, 0, "lost"},
                        {"a body of 2^56 bytes", 42, 1, "lost"},
                        {"a body of 16 MB", 46, 1, "lost"},
                        {"a longer body", 49, 49, "more"},
                        {"a wrong CRC", 57, 0, "damaged"},
                        {"a shorter body", 49, 47, "damaged"}};
  for (const Case& c : cases) {
    auto bad = good;
    bad[c.at] = static_cast<std::byte>(c.value);
    if (c.at == 57 && bad == good) bad[c.at] = std::byte{1};
    IgtlFramer framer;
    framer.feed(bad);
    EXPECT_EQ(kind_of(framer), c.kind) << c.what;
  }
}

TEST(IgtlFramer, AVersion2BodyMustHoldWhatItSays) {
  IgtlMessage message = transform(2);
  message.metadata = {{"key", "value"}};
  const auto good = encode_igtl(message);
  // Every byte of the extended header and of the index, changed, with a right CRC: an error or at most other content.
  for (std::size_t at = 58; at < 58 + 12; ++at) {
    auto bad = good;
    bad[at] = std::byte{0xFF};
    const std::uint64_t crc = igtl_crc(std::span(bad).subspan(58));
    for (std::size_t i = 0; i < 8; ++i) bad[50 + i] = static_cast<std::byte>(crc >> (56 - 8 * i) & 0xFFU);
    IgtlFramer framer;
    framer.feed(bad);
    EXPECT_THAT(kind_of(framer), ::testing::AnyOf("damaged", "TRANSFORM")) << at;
  }
}

TEST(IgtlDecoding, MalformedBodiesGiveNoPose) {
  const auto good = encode_igtl_transform(kPose);
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(decode_igtl_transform(std::span(good).first(size)));
  EXPECT_FALSE(decode_igtl_transform(std::vector<std::byte>(48)));                   // zeros
  EXPECT_FALSE(decode_igtl_transform(std::vector<std::byte>(48, std::byte{0xFF})));  // not numbers
  Pose mirrored = kPose;
  mirrored.R.col(0) *= -1.0;
  EXPECT_FALSE(decode_igtl_transform(encode_igtl_transform(mirrored)));
  Pose scaled = kPose;
  scaled.R *= 1.2;
  EXPECT_FALSE(decode_igtl_transform(encode_igtl_transform(scaled)));
  const auto position = encode_igtl_position(kPose);
  for (std::size_t size = 0; size < position.size(); ++size) {
    if (size == 24) continue;  // the form with three components of the quaternion
    EXPECT_FALSE(decode_igtl_position(std::span(position).first(size))) << size;
  }
  EXPECT_FALSE(decode_igtl_position(std::vector<std::byte>(24, std::byte{0xFF})));
  // Three components that are longer than a unit quaternion: 0x3F66 is 0.9.
  std::vector<std::byte> too_long(24);
  for (const std::size_t at : {12U, 16U}) {
    too_long[at] = std::byte{0x3F};
    too_long[at + 1] = std::byte{0x66};
  }
  EXPECT_FALSE(decode_igtl_position(too_long));
  EXPECT_FALSE(decode_igtl_position(std::vector<std::byte>(28)));
  EXPECT_FALSE(decode_igtl_tdata(std::vector<std::byte>(69)));
  EXPECT_FALSE(decode_igtl_tdata(std::vector<std::byte>(70)));
  EXPECT_FALSE(decode_igtl_status(std::vector<std::byte>(29)));
}

// ---- sessions

struct Theatre {
  Theatre(IgtlSettings settings, IgtlEmulatorSettings device_settings, const EmulatorFaults& faults = {})
      : device(track(), std::move(device_settings), faults),
        session(
            std::move(settings), [this](const TrackerSample& sample) { samples.push_back(sample); }, health) {
    device.on_open(far, now);
    session.on_open(host, now);
  }
  static const PoseTrack& track() {
    static const PoseTrack swaying = PoseTrack::swaying(kStart, 50.0);
    return swaying;
  }
  void run(Duration longest) {
    for (const Instant end = now + longest; now < end && host.failure.empty(); now += milliseconds(1)) {
      if (now >= device.next_time()) device.on_time(far, now);
      const std::string sent = far.take_sent();
      if (!sent.empty()) session.on_bytes(host, std::as_bytes(std::span(sent.data(), sent.size())), now);
      if (now >= session.next_time()) session.on_time(host, now);
    }
  }

  Instant now = kStart;
  std::vector<TrackerSample> samples;
  DeviceHealth health;
  ScriptedLink far;
  IgtlEmulator device;
  ScriptedLink host;
  IgtlSession session;
};

TEST(IgtlSession, GivesEveryPoseByTransformTdataAndPosition) {
  using Message = IgtlEmulatorSettings::Message;
  for (const Message message : {Message::kTransform, Message::kTdata, Message::kPosition}) {
    for (const unsigned version : {1U, 2U}) {
      SCOPED_TRACE(static_cast<int>(message));
      EmulatorFaults drifting;
      drifting.drift_ppm = 200.0;
      Theatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}}, {message, version, "Scope"},
                      drifting);
      theatre.run(seconds(4));
      ASSERT_EQ(theatre.host.failure, "");
      EXPECT_THAT(theatre.host.sent, HasSubstr("STT_TDATA"));
      ASSERT_NEAR(static_cast<double>(theatre.samples.size()), 200.0, 2.0);
      for (std::size_t i = 0; i < theatre.samples.size(); ++i) {
        const TrackerSample& sample = theatre.samples[i];
        ASSERT_EQ(sample.state, ToolState::kOk);
        ASSERT_LT((sample.X_WS.t - Theatre::track().at(static_cast<std::int64_t>(i)).X_TO.t).norm(), 1e-3);
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

TEST(IgtlSession, AToolLeftOutOfTdataOrMarkedSoIsMissing) {
  using Message = IgtlEmulatorSettings::Message;
  EmulatorFaults faults;
  faults.missing_every = seconds(1);
  faults.missing_for = milliseconds(300);
  for (const auto& [message, version] : {std::pair{Message::kTdata, 1U}, std::pair{Message::kTransform, 2U}}) {
    Theatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}}, {message, version, "Scope"}, faults);
    theatre.run(seconds(2));
    ASSERT_GT(theatre.samples.size(), 95U);
    for (std::size_t i = 0; i < theatre.samples.size(); ++i) {
      EXPECT_EQ(theatre.samples[i].state == ToolState::kMissing, i % 50 >= 35) << i;
    }
  }
}

TEST(IgtlSession, OtherToolsAreNotTheSensor) {
  Theatre theatre({.sensor = "Probe", .reference = std::nullopt, .world = {}}, {});
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
      {"Wrong", "Other", "no tool 'Wrong' and no tool 'Other' in 2 s; the server sends Probe, Patient"},
  };
  for (const bool tdata : {true, false}) {
    for (const Case& c : cases) {
      SCOPED_TRACE(c.reason);
      Listener listener({.sensor = c.sensor, .reference = c.reference, .world = {}});
      listener.health.set_state(DeviceState::kStarting);
      for (int i = 0; i < 500; ++i) {
        const Duration at = milliseconds(10 * i);
        if (tdata) {
          listener.send("TDATA", "Tracker", encode_igtl_tdata(sent), at, (1ULL << 32U) + static_cast<unsigned>(i));
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
  Theatre theatre({.sensor = "Scope", .reference = std::nullopt, .world = {}}, {}, faults);
  theatre.run(seconds(20));
  EXPECT_GT(theatre.health.damaged.get(), 20U);
  EXPECT_GT(theatre.samples.size(), 800U);
  for (const TrackerSample& sample : theatre.samples) {
    double nearest = 1e9;
    const auto frame = (sample.arrival - kStart) / milliseconds(20);
    for (std::int64_t near = frame - 1; near <= frame + 1; ++near) {
      nearest = std::min(nearest, (sample.X_WS.t - Theatre::track().at(near).X_TO.t).norm());
    }
    EXPECT_LT(nearest, 1e-3);
  }
}

}  // namespace
}  // namespace perimap
