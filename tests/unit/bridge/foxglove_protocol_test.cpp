#include "daemon/bridge/foxglove_protocol/foxglove_protocol.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

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
            "\x01\x04\x03\x02\x01\x88\x77\x66\x55\x44\x33\x22\x11"
            "abc"s);
}

}  // namespace
}  // namespace perimap
