#include "daemon/runtime/device_news.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

struct News : ::testing::Test {
  DeviceNews news{"tracker"};
  Instant now{seconds(100)};
  std::vector<std::string> told;

  void see(DeviceState state, const std::string& reason) {
    now += milliseconds(100);
    if (auto line = news.next(state, reason, "", now)) told.push_back(line->text);
  }
  // Ten times a second two reasons take turns.
  void flap(Duration time) {
    for (int i = 0; i < time / milliseconds(100); ++i) see(DeviceState::kStreaming, i % 2 == 0 ? "off" : "on");
  }
};

TEST_F(News, EachChangeIsToldOnceAsLongAsThereAreFew) {
  see(DeviceState::kStarting, "");
  see(DeviceState::kStreaming, "");
  see(DeviceState::kStreaming, "");
  see(DeviceState::kStreaming, "status 13");
  see(DeviceState::kStreaming, "");
  see(DeviceState::kClosed, "unplugged");
  see(DeviceState::kClosed, "no such port");
  EXPECT_EQ(told, (std::vector<std::string>{"tracker: starting", "tracker: streaming", "tracker: status 13",
                                            "tracker: unplugged", "tracker: no such port"}));
}

TEST_F(News, AReasonThatFlapsDoesNotFloodTheLog) {
  constexpr auto kTime = std::chrono::minutes(10);
  flap(kTime);
  EXPECT_GE(told.size(), static_cast<std::size_t>(DeviceNews::kAtOnce));
  EXPECT_LE(told.size(), static_cast<std::size_t>(DeviceNews::kAtOnce + kTime / DeviceNews::kEvery));
  EXPECT_THAT(told.back(), HasSubstr("99 changes before that are not told"));
}

TEST_F(News, WhatItIsInTheEndIsTold) {
  flap(seconds(30));
  see(DeviceState::kClosed, "unplugged");
  for (int i = 0; i < 100; ++i) see(DeviceState::kClosed, "unplugged");
  EXPECT_THAT(told.back(), HasSubstr("tracker: unplugged"));
  const std::size_t lines = told.size();
  for (int i = 0; i < 1000; ++i) see(DeviceState::kClosed, "unplugged");
  EXPECT_EQ(told.size(), lines) << "once";
}

TEST_F(News, AfterAQuietTimeChangesAreToldAtOnceAgain) {
  flap(seconds(30));
  now += DeviceNews::kAtOnce * DeviceNews::kEvery;
  told.clear();
  see(DeviceState::kSilent, "");
  see(DeviceState::kStreaming, "");
  EXPECT_EQ(told.size(), 2U);
}

TEST(DeviceNews, ANoticeIsToldOnceAndAgainWhenItIsAnother) {
  DeviceNews news("tracker");
  EXPECT_FALSE(news.note(""));
  EXPECT_EQ(news.note("the pointer is not there"), "tracker: the pointer is not there");
  EXPECT_FALSE(news.note("the pointer is not there"));
  EXPECT_FALSE(news.note("")) << "while it is opened anew";
  EXPECT_FALSE(news.note("the pointer is not there"));
  EXPECT_TRUE(news.note("port handle 0D is left alone"));
}

}  // namespace
}  // namespace perimap
