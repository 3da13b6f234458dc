#include "drivers/tracker/stamp_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <string_view>

namespace perimap {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr double kUnit = 4294967296.0;
const Instant kStart(std::chrono::seconds(1000));

std::uint64_t fixed(double seconds) { return static_cast<std::uint64_t>(std::llround(seconds * kUnit)); }

// A message each `period_s`, late by up to `jitter_s` and in order; `stamp` of the time that has passed.
struct Stream {
  double period_s = 1.0 / 60.0;
  double jitter_s = 0.0;
  std::function<std::uint64_t(double)> stamp = [](double t) { return fixed(1.7e9 + t); };

  void run(StampCheck& check, double from_s, double to_s, const std::function<void(double)>& each = {}) const {
    std::mt19937 random(7);
    std::uniform_real_distribution<> late(0.0, jitter_s);
    Instant last = kStart;
    for (double t = from_s; t < to_s; t += period_s) {
      last = std::max(last, kStart + from_seconds(t + late(random)));
      check.observe(stamp(t), last);
      if (each) each(t);
    }
  }
};

TEST(StampCheck, SecondsOfAClockAreRightFromASecondOn) {
  for (const double jitter_s : {0.0, 0.02, 0.1}) {
    for (const double pace : {1.0, 1.002, 0.998}) {
      StampCheck check;
      Stream stream{.jitter_s = jitter_s, .stamp = [pace](double t) { return fixed(5.0 + pace * t); }};
      stream.run(check, 0.0, 60.0, [&](double t) {
        ASSERT_FALSE(check.wrong()) << t << ": " << check.fault();
        ASSERT_TRUE(check.judged() || t < 1.5);
      });
    }
  }
}

struct Wrong {
  const char* fault;
  std::function<std::uint64_t(double)> stamp;
};

TEST(StampCheck, EachFaultIsNamedBeforeAnyStampIsUsed) {
  const double begun = 1.7e9 + 0.4;
  const std::vector<Wrong> all{
      {"milliseconds where seconds belong",
       [=](double t) { return static_cast<std::uint64_t>(std::floor(1e3 * (begun + t))) << 32U; }},
      {"milliseconds where seconds belong", [](double t) { return fixed(1e3 * t + 7.0); }},
      {"microseconds where seconds belong",
       [=](double t) { return static_cast<std::uint64_t>(std::llround(1e6 * (begun + t))) << 32U; }},
      {"nanoseconds where seconds belong",
       [=](double t) { return static_cast<std::uint64_t>(std::llround(1e9 * (1e3 + t))) << 32U; }},
      {"whole seconds", [=](double t) { return fixed(std::floor(begun + t)); }},
      {"fractions of a second in nanoseconds",
       [=](double t) {
         const double whole = std::floor(begun + t);
         return fixed(whole) + static_cast<std::uint64_t>(std::llround(1e9 * (begun + t - whole)));
       }},
      {"counts, such as frame numbers, 60 a second",
       [](double t) { return static_cast<std::uint64_t>(std::llround(60.0 * t) + 1) << 32U; }},
      {"the same", [=](double) { return fixed(begun); }},
      {"of a clock that runs at 0.5", [](double t) { return fixed(9.0 + 0.51 * t); }},
      {"of a clock that runs at 2.0", [](double t) { return fixed(9.0 + 2.05 * t); }},
  };
  for (const double jitter_s : {0.0, 0.015}) {
    for (const Wrong& wrong : all) {
      SCOPED_TRACE(wrong.fault);
      StampCheck check;
      Stream{.jitter_s = jitter_s, .stamp = wrong.stamp}.run(
          check, 0.0, 3.0, [&](double t) { ASSERT_TRUE(check.wrong() || !check.judged()) << t; });
      EXPECT_TRUE(check.judged());
      EXPECT_THAT(check.fault(), HasSubstr(wrong.fault));
    }
  }
}

TEST(StampCheck, AClockThatIsALittleSlowIsFoundInTheEnd) {
  for (const auto& [pace, found_s] : {std::pair{0.9, 3.5}, {0.97, 18.0}, {1.02, 18.0}}) {
    StampCheck check;
    Stream{.jitter_s = 0.01, .stamp = [pace = pace](double t) { return fixed(9.0 + pace * t); }}.run(check, 0.0,
                                                                                                     found_s);
    EXPECT_TRUE(check.wrong()) << pace;
    constexpr std::string_view kSaid = "of a clock that runs at ";
    ASSERT_TRUE(check.fault().starts_with(kSaid)) << check.fault();
    EXPECT_NEAR(std::stod(check.fault().substr(kSaid.size())), pace, 0.01);
  }
}

TEST(StampCheck, ANetworkThatStandsStillAndAClockThatIsSetAreNoFault) {
  StampCheck check;
  Stream stream;
  stream.run(check, 0.0, 5.0);
  // Nothing for 0.45 s, and then all at once.
  for (double t = 5.0; t < 5.45; t += 1.0 / 60.0) check.observe(fixed(1.7e9 + t), kStart + from_seconds(5.45));
  stream.run(check, 5.46, 15.0, [&](double t) { ASSERT_FALSE(check.wrong()) << t; });
  for (const double set_s : {+3600.0, -2.0, 0.3}) {
    StampCheck other;
    stream.run(other, 0.0, 5.0);
    Stream{.stamp = [set_s](double t) { return fixed(1.7e9 + set_s + t); }}.run(
        other, 5.0, 20.0, [&](double t) { ASSERT_FALSE(other.wrong()) << set_s << " s, at " << t; });
  }
}

TEST(StampCheck, ANetworkThatBecomesSlowerIsNoSlowClock) {
  StampCheck check;
  for (double t = 0.0; t < 40.0; t += 1.0 / 60.0) {
    const double late_s = std::clamp(0.1 * (t - 10.0), 0.0, 0.1);  // from 10 s to 11 s it rises by 100 ms
    check.observe(fixed(1.7e9 + t), kStart + from_seconds(t + late_s));
    ASSERT_FALSE(check.wrong()) << t << ": " << check.fault();
  }
}

TEST(StampCheck, WhatWasWrongIsRightAfterASecondOfGoodStamps) {
  StampCheck check;
  Stream{.stamp = [](double t) { return fixed(std::floor(50.0 + t)); }}.run(check, 0.0, 4.0);
  ASSERT_TRUE(check.wrong());
  Stream{.stamp = [](double t) { return fixed(50.0 + t); }}.run(check, 4.0, 7.5);
  EXPECT_FALSE(check.wrong());
  EXPECT_EQ(check.fault(), "");
}

TEST(StampCheck, WhatWasWrongIsNotForgottenWithTheConnection) {
  StampCheck check;
  Stream{.stamp = [](double t) { return fixed(9.0 + 0.5 * t); }}.run(check, 0.0, 3.0);
  ASSERT_TRUE(check.wrong());
  check.restart();
  EXPECT_TRUE(check.wrong());
  EXPECT_THAT(check.fault(), HasSubstr("0.5"));
}

}  // namespace
}  // namespace perimap
