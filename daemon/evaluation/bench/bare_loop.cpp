#include "daemon/evaluation/bench/bare_loop.hpp"

#include <algorithm>

#include "core/realtime/deadline.hpp"

namespace perimap::bench {
namespace {

constexpr Duration kAside = std::chrono::milliseconds(2);
constexpr Duration kIdle = std::chrono::milliseconds(10);
// A wait begins at least so long before its deadline, so that it is one.
constexpr Duration kShortestWait = std::chrono::microseconds(500);

}  // namespace

Instant beside_a_release(Instant newest, Duration period, Duration offset, Instant earliest) noexcept {
  const Instant first = newest + offset;
  if (first > earliest) return first;
  return first + period * ((earliest - first) / period + 1);
}

BareLoop::BareLoop(ThreadLauncher& threads, const ReleaseLog& releases, std::size_t capacity) : releases_(releases) {
  waits_.reserve(capacity);
  thread_ = threads.launch("bare-loop", ThreadRole::kPublisher, [this] { run(); });
}

void BareLoop::stop() {
  stopping_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) thread_.join();
}

void BareLoop::run() {
  for (bool after = false; !stopping_.load(std::memory_order_relaxed); after = !after) {
    const Duration period(releases_.period_ns());
    const Instant now = MonotonicClock::now();
    if (period <= Duration(0) || waits_.size() == waits_.capacity()) {
      sleep_until(now + kIdle);
      continue;
    }
    const Duration aside = std::min(kAside, period / 4);
    const Instant deadline =
        beside_a_release(from_ns(releases_.newest_deadline_ns()), period, after ? aside : -aside, now + kShortestWait);
    wait_until_exactly(deadline);
    waits_.push_back({deadline, MonotonicClock::now() - deadline});
  }
}

}  // namespace perimap::bench
