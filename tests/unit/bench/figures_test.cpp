#include "daemon/bench/figures.hpp"

#include <gtest/gtest.h>

#include "daemon/bench/bare_loop.hpp"
#include "daemon/bench/bench.hpp"
#include "daemon/bench/subscriber.hpp"

namespace perimap::bench {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

TEST(Figures, AreNearestRankPercentilesOfAllValues) {
  std::vector<Duration> durations;
  for (int i = 1000; i >= 1; --i) durations.push_back(microseconds(i));
  const Figures f = figures_of(durations);
  EXPECT_EQ(f.count, 1000U);
  EXPECT_EQ(f.p50, microseconds(500));
  EXPECT_EQ(f.p99, microseconds(990));
  EXPECT_EQ(f.p999, microseconds(999));
  EXPECT_EQ(f.max, microseconds(1000));
  EXPECT_DOUBLE_EQ(f.on_time, 0.5);
}

TEST(Figures, OfFewValuesTheHighPercentilesAreTheLargest) {
  const Figures f = figures_of({microseconds(700), microseconds(3)});
  EXPECT_EQ(f.p50, microseconds(3));
  EXPECT_EQ(f.p99, microseconds(700));
  EXPECT_EQ(f.p999, microseconds(700));
  EXPECT_DOUBLE_EQ(f.on_time, 0.5);
}

TEST(Figures, OfNothingAreZero) { EXPECT_EQ(figures_of({}).count, 0U); }

TEST(MissingNumbers, AreThoseSentAndNeverReceived) {
  const std::uint64_t sent[] = {10, 11, 12, 13};
  const std::uint64_t received[] = {9, 11, 13, 10, 14};
  EXPECT_EQ(missing_numbers(sent, received), 1U);
  EXPECT_EQ(missing_numbers(sent, {}), 4U);
  EXPECT_EQ(missing_numbers({}, received), 0U);
}

TEST(Receipts, AreReadFromTheSubscribersLinesAndNothingElse) {
  const auto receipt = parse_receipt("17 123456789");
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->sequence, 17U);
  EXPECT_EQ(receipt->time, from_ns(123456789));
  for (const char* line : {"", "17", "17 ", " 17 1", "17 1 ", "17 x", "-1 1", "17  1", "99999999999999999999 1"}) {
    EXPECT_FALSE(parse_receipt(line)) << '"' << line << '"';
  }
}

// Releases every 10 ms, the newest at 100 ms.
Instant beside(Duration offset, Duration earliest) {
  return beside_a_release(from_ns(0) + milliseconds(100), milliseconds(10), offset, from_ns(0) + earliest);
}

TEST(BareLoopDeadlines, LieBesideTheNextReleaseAndLaterThanTheEarliest) {
  EXPECT_EQ(beside(milliseconds(2), milliseconds(101)), from_ns(0) + milliseconds(102));
  EXPECT_EQ(beside(milliseconds(-2), milliseconds(101)), from_ns(0) + milliseconds(108));
  EXPECT_EQ(beside(milliseconds(2), milliseconds(102)), from_ns(0) + milliseconds(112));
  EXPECT_EQ(beside(milliseconds(-2), milliseconds(543)), from_ns(0) + milliseconds(548));
}

TEST(LiveCases, RunWithAndWithoutPriorityInTurn) {
  BenchSettings settings;
  settings.parts = {"live"};
  settings.runs = 3;
  const auto cases = live_cases(settings, true);
  ASSERT_EQ(cases.size(), 6U);
  for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_EQ(cases[i].priority > 0, i % 2 == 1) << i;
}

TEST(LiveCases, WithoutThePrivilegeNoneAsksForPriorityAndOnlyTheLoadAndTheLiveRunsAreFewer) {
  BenchSettings settings;
  settings.parts.insert(kParts.begin(), kParts.end());
  const auto permitted = live_cases(settings, true);
  const auto refused = live_cases(settings, false);
  for (const LiveCase& one : refused) EXPECT_EQ(one.priority, 0) << one.name;
  EXPECT_EQ(permitted.size() - refused.size(), static_cast<std::size_t>(settings.runs) + 1);
}

}  // namespace
}  // namespace perimap::bench
