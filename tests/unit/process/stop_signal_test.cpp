#include "daemon/process/stop_signal.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "daemon/process/saved_signal_mask.hpp"

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

TEST(SavedSignalMask, LetsSignalsThroughAsBefore) {
  const auto blocked = [] {
    sigset_t mask;
    pthread_sigmask(SIG_SETMASK, nullptr, &mask);
    return sigismember(&mask, SIGINT) == 1;
  };
  std::jthread([&] {
    sigset_t all;
    sigemptyset(&all);
    pthread_sigmask(SIG_SETMASK, &all, nullptr);
    {
      const SavedSignalMask as_before;
      const auto stop = StopSignal::install();
      ASSERT_TRUE(stop);
      EXPECT_TRUE(blocked());
    }
    EXPECT_FALSE(blocked());
  }).join();
}

}  // namespace
}  // namespace perimap
