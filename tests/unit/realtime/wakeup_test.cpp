#include "core/realtime/wakeup.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "core/realtime/deadline.hpp"

namespace perimap {
namespace {

TEST(Wakeup, APostBeforeTheWaitIsNotLost) {
  Wakeup wakeup;
  wakeup.post();
  EXPECT_TRUE(wakeup.wait_until(MonotonicClock::now()));
}

TEST(Wakeup, WaitReportsThatTheDeadlinePassed) {
  Wakeup wakeup;
  const Instant deadline = MonotonicClock::now() + std::chrono::milliseconds(5);
  EXPECT_FALSE(wakeup.wait_until(deadline));
  EXPECT_GE(MonotonicClock::now(), deadline);
}

TEST(Wakeup, WakesAnotherThread) {
  Wakeup there;
  Wakeup back;
  std::thread other([&] {
    there.wait();
    back.post();
  });
  there.post();
  EXPECT_TRUE(back.wait_until(MonotonicClock::now() + std::chrono::seconds(30)));
  other.join();
}

TEST(SleepUntil, NeverReturnsEarly) {
  const Instant deadline = MonotonicClock::now() + std::chrono::milliseconds(3);
  sleep_until(deadline);
  EXPECT_GE(MonotonicClock::now(), deadline);
  sleep_until(deadline);  // an instant in the past returns at once
}

TEST(WaitUntilExactly, NeverReturnsBeforeTheDeadlineAndAtOnceAfterIt) {
  for (const Duration ahead : {Duration(0), kSpin / 2, 3 * kSpin, Duration(std::chrono::milliseconds(5))}) {
    const Instant deadline = MonotonicClock::now() + ahead;
    wait_until_exactly(deadline);
    EXPECT_GE(MonotonicClock::now(), deadline) << ahead.count();
    wait_until_exactly(deadline);
  }
}

}  // namespace
}  // namespace perimap
