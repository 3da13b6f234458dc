// What the machine itself allows: a loop that only waits, beside the releases.
#pragma once

#include <atomic>
#include <span>
#include <thread>
#include <vector>

#include "core/time/instant.hpp"
#include "daemon/evaluation/bench/release_log.hpp"
#include "daemon/runtime/thread_launcher.hpp"

namespace perimap::bench {

struct BareWait {
  Instant deadline;
  Duration tardiness{0};
};

// The first instant later than `earliest` that lies `offset` from a release, when releases are due at `newest` and
// every `period` (> 0) before and after.
[[nodiscard]] Instant beside_a_release(Instant newest, Duration period, Duration offset, Instant earliest) noexcept;

// Waits as the publisher does, with its priority and on its processor, 2 ms before and 2 ms after each release (or a
// quarter of the period), so that both meet the same moments of the machine and never each other.
class BareLoop {
 public:
  // `threads` and `releases` must outlive it.
  BareLoop(ThreadLauncher& threads, const ReleaseLog& releases, std::size_t capacity);
  BareLoop(const BareLoop&) = delete;
  BareLoop& operator=(const BareLoop&) = delete;
  ~BareLoop() { stop(); }

  // Ends and joins the thread. Called twice it does nothing.
  void stop();
  // After stop().
  [[nodiscard]] std::span<const BareWait> waits() const noexcept { return waits_; }

 private:
  void run();

  const ReleaseLog& releases_;
  std::vector<BareWait> waits_;
  // Relaxed: a message by itself.
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace perimap::bench
