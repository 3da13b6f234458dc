#include "daemon/process/stop_signal.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <thread>

namespace perimap {
namespace {

TEST(StopSignal, IsNotRequestedBeforeASignalAndStaysRequestedAfterOne) {
  Expected<StopSignal> stop = StopSignal::install();
  ASSERT_TRUE(stop) << stop.error().message;
  EXPECT_FALSE(stop->requested());
  raise(SIGTERM);
  EXPECT_TRUE(stop->requested());
  EXPECT_TRUE(stop->requested());
  EXPECT_TRUE(stop->wait_for(std::chrono::hours(1)));
}

TEST(StopSignal, ASignalToTheProcessEndsAWait) {
  Expected<StopSignal> stop = StopSignal::install();
  ASSERT_TRUE(stop) << stop.error().message;
  std::jthread sender([] { kill(getpid(), SIGINT); });
  EXPECT_TRUE(stop->wait_for(std::chrono::hours(1)));
}

TEST(StopSignal, AWaitEndsAfterItsTimeWithoutASignal) {
  Expected<StopSignal> stop = StopSignal::install();
  ASSERT_TRUE(stop) << stop.error().message;
  const Instant start = MonotonicClock::now();
  EXPECT_FALSE(stop->wait_for(std::chrono::milliseconds(20)));
  EXPECT_GE(MonotonicClock::now() - start, std::chrono::milliseconds(20));
}

}  // namespace
}  // namespace perimap
