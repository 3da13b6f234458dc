// Wakes one thread that sleeps for an event, a deadline, or both.
#pragma once

#include <semaphore.h>

#include <cerrno>
#include <ctime>

#include "core/time/instant.hpp"

namespace perimap {

// A POSIX semaphore: a futex underneath, no allocation, post() never blocks. Unlike std::counting_semaphore it takes
// an absolute deadline on CLOCK_MONOTONIC (sem_clockwait, glibc 2.30).
class Wakeup {
 public:
  Wakeup() noexcept { sem_init(&semaphore_, 0, 0); }
  ~Wakeup() { sem_destroy(&semaphore_); }
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;

  void post() noexcept { sem_post(&semaphore_); }

  void wait() noexcept {
    while (sem_wait(&semaphore_) != 0 && errno == EINTR) {
    }
  }

  // Forgets the posts so far. What they announced must be looked for after this, or it is missed until the next post.
  void clear() noexcept {
    while (sem_trywait(&semaphore_) == 0) {
    }
  }

  // True when posted, false when the deadline passed first.
  [[nodiscard]] bool wait_until(Instant deadline) noexcept {
    const auto ns = to_ns(deadline);
    const std::timespec ts{ns / 1'000'000'000, ns % 1'000'000'000};
    for (;;) {
      if (sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &ts) == 0) return true;
      if (errno != EINTR) return false;
    }
  }

 private:
  sem_t semaphore_{};
};

}  // namespace perimap
