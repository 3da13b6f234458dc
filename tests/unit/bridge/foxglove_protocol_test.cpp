#include "daemon/bridge/foxglove/foxglove_protocol.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "daemon/bridge/foxglove/surface_messages.hpp"
#include "daemon/bridge/messages/view_topics.hpp"

namespace perimap {
namespace {

using namespace std::string_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TEST(FoxgloveRequest, IsSubscriptionsAndTheirEnds) {
  const auto request = parse_foxglove_request(
      R"({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 2}, {"id": 4294967295, "channelId": 0}]})");
  ASSERT_TRUE(request) << request.error().message;
  ASSERT_THAT(request->subscribe, SizeIs(2));
  EXPECT_EQ(request->subscribe[0].id, 7U);
  EXPECT_EQ(request->subscribe[0].channel, 2U);
  EXPECT_EQ(request->subscribe[1].id, 4294967295U);
  const auto end = parse_foxglove_request(R"({"op": "unsubscribe", "subscriptionIds": [7, 8]})");
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_THAT(end->unsubscribe, ElementsAre(7U, 8U));
}

TEST(FoxgloveRequest, WhatThisServerDoesNotOfferAsksForNothing) {
  for (const char* text : {R"({"op": "getParameters", "parameterNames": []})", R"({"op": "advertise", "channels": []})",
                           R"({"op": ""})", R"({"op": "subscribe", "subscriptions": []})"}) {
    const auto request = parse_foxglove_request(text);
    ASSERT_TRUE(request) << text;
    EXPECT_THAT(request->subscribe, IsEmpty());
    EXPECT_THAT(request->unsubscribe, IsEmpty());
  }
}

TEST(FoxgloveRequest, WhatIsGarbledIsRefusedInOnePrintableLine) {
  for (const std::string& text :
       {""s, "{"s, "null"s, "[]"s, "7"s, "{}"s, R"({"op": 1})"s, R"({"op": "subscribe"})"s, "\x01\x00\x00"s,
        R"({"op": "subscribe", "subscriptions": {}})"s, R"({"op": "subscribe", "subscriptions": [7]})"s,
        R"({"op": "subscribe", "subscriptions": [{"id": 7}]})"s,
        R"({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 0}]})"s,
        R"({"op": "subscribe", "subscriptions": [{"id": 4294967296, "channelId": 0}]})"s,
        R"({"op": "subscribe", "subscriptions": [{"id": 1.5, "channelId": 0}]})"s,
        R"({"op": "unsubscribe", "subscriptionIds": ["7"]})"s, R"({"op": "unsubscribe"})"s, "\xFF\xFE"s,
        std::string(2000, '[')}) {
    const auto request = parse_foxglove_request(text);
    ASSERT_FALSE(request) << text;
    EXPECT_TRUE(std::all_of(request.error().message.begin(), request.error().message.end(), [](char c) {
      return c >= ' ' && c <= '~';
    })) << request.error().message;
  }
}

TEST(FoxgloveMessages, OfAChannelAreItsSubscriptionTheTimeAndTheBytes) {
  EXPECT_EQ(foxglove_message(0x01020304, from_ns(0x1122334455667788), "abc"),
            "\x01\x04\x03\x02\x01\x88\x77\x66\x55\x44\x33\x22\x11"s + "abc");
}

TEST(FoxgloveMessages, ChannelsCarryTheTextOfTheirTypes) {
  const auto json = nlohmann::json::parse(foxglove_advertise(surface_channels()));
  EXPECT_EQ(json["op"], "advertise");
  ASSERT_EQ(json["channels"].size(), kSurfaceChannels);
  for (std::size_t i = 0; i < kSurfaceChannels; ++i) {
    const auto& channel = json["channels"][i];
    EXPECT_EQ(channel["id"], i);
    EXPECT_EQ(channel["encoding"], "cdr");
    EXPECT_EQ(channel["schemaEncoding"], "omgidl");
    const std::string name = channel["schemaName"];
    const std::string text = channel["schema"];
    EXPECT_NE(text.find("struct " + name.substr(name.rfind(':') + 1)), std::string::npos) << name;
  }
}

class SurfaceMessagesTest : public testing::Test {
 protected:
  static ShownSurface good() {
    ShownSurface shown;
    shown.state = perimap_SURFACE_GOOD;
    shown.frame_id = "world";
    shown.phase_rad = 1.25;
    shown.valid = from_ns(5'000'000'000);
    shown.valid_until = shown.valid + std::chrono::milliseconds(200);
    shown.capture = shown.valid - std::chrono::milliseconds(50);
    shown.utc_minus_monotonic = std::chrono::seconds(1'795'000'000);
    shown.X_WC = Pose{so3_exp(Vector3d(0.3, -0.4, 0.5)), Vector3d(10, -20, 30)};
    shown.features = {{3, perimap_FEATURE_CONVERGED, {1, 2, 3}, 0.25}};
    return shown;
  }
  template <class T>
  static Sample<T> read(const SurfaceMessages& messages, SurfaceChannel channel) {
    const std::string& cdr = messages[static_cast<std::size_t>(channel)].cdr;
    auto sample = deserialize<T>(std::as_bytes(std::span(cdr)));
    EXPECT_TRUE(sample) << sample.error().message;
    return std::move(*sample);
  }
  SurfaceMessageMaker maker_;
};

TEST_F(SurfaceMessagesTest, StandAtTheInstantThatTheySpeakOf) {
  const auto messages = maker_.of(good(), from_ns(1));
  ASSERT_TRUE(messages) << messages.error().message;
  const auto utc_ns = [&](SurfaceChannel channel) { return to_ns((*messages)[static_cast<std::size_t>(channel)].utc); };
  EXPECT_EQ(utc_ns(SurfaceChannel::kScene), 1'795'000'005'000'000'000);
  EXPECT_EQ(utc_ns(SurfaceChannel::kWorth), 1'795'000'005'000'000'000);
  EXPECT_EQ(utc_ns(SurfaceChannel::kTransforms), 1'795'000'004'950'000'000);
  const auto scene = read<foxglove_SceneUpdate>(*messages, SurfaceChannel::kScene);
  ASSERT_EQ(scene->entities._length, 2U);
  const foxglove_SceneEntity& features = scene->entities._buffer[1];
  EXPECT_STREQ(features.frame_id, "world");
  ASSERT_EQ(features.spheres._length, 1U);
  EXPECT_NEAR(features.spheres._buffer[0].pose.position.z, 0.003, 1e-12);
  const auto worth = read<perimap_view_SurfaceWorth>(*messages, SurfaceChannel::kWorth);
  EXPECT_STREQ(worth->state, "good");
  EXPECT_EQ(worth->converged, 1U);
  EXPECT_EQ(worth->phase_rad, 1.25);
  const auto transform = read<foxglove_FrameTransform>(*messages, SurfaceChannel::kTransforms);
  EXPECT_STREQ(transform->parent_frame_id, "world");
  EXPECT_NEAR(transform->translation.y, -0.02, 1e-12);
}

TEST_F(SurfaceMessagesTest, OfNothingTakeAwayWhatWasShown) {
  ASSERT_TRUE(maker_.of(good(), from_ns(1)));
  ShownSurface nothing;
  nothing.frame_id = "world";
  const auto messages = maker_.of(nothing, from_ns(1'795'000'000'000'000'000));
  ASSERT_TRUE(messages) << messages.error().message;
  const auto scene = read<foxglove_SceneUpdate>(*messages, SurfaceChannel::kScene);
  EXPECT_EQ(scene->entities._length, 0U);
  EXPECT_GT(scene->deletions._length, 0U);
  EXPECT_EQ((*messages)[0].utc, from_ns(1'795'000'000'000'000'000));
  EXPECT_STREQ(read<perimap_view_SurfaceWorth>(*messages, SurfaceChannel::kWorth)->state, "invalid");
  EXPECT_TRUE((*messages)[static_cast<std::size_t>(SurfaceChannel::kTransforms)].cdr.empty());
}

}  // namespace
}  // namespace perimap
