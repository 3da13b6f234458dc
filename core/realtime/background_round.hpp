// One piece of work at a time that one thread asks of another, which may take its time over it.
#pragma once

#include <atomic>

#include "core/realtime/realtime_scope.hpp"
#include "core/realtime/wakeup.hpp"

namespace perimap {

// What the work is made of, and what comes of it, are the asking thread's but from begin() until finish() has been
// true: then they are the serving thread's. Asking neither allocates nor blocks, unless the work is awaited.
class BackgroundRound {
 public:
  // `awaited`: finish() waits, so that a replay has what was asked at the frame that was stated.
  explicit BackgroundRound(bool awaited) noexcept : awaited_(awaited) {}

  // Asking thread.
  [[nodiscard]] bool under_way() const noexcept { return under_way_; }
  void begin() noexcept {
    under_way_ = true;
    // Relaxed: the serving thread stores only after it has been woken, and the post orders that.
    done_.store(false, std::memory_order_relaxed);
    go_.post();
  }
  // Whether what was asked is done, and not under way any more; never true when nothing is.
  [[nodiscard]] bool finish() noexcept {
    if (!under_way_) return false;
    if (awaited_) {
      const NamedWait wait;
      finished_.wait();
    }
    // Acquire: pairs with the release of serve(), so that all that came of the work is visible.
    if (!done_.load(std::memory_order_acquire)) return false;
    under_way_ = false;
    return true;
  }

  // Serving thread: does what is asked until dismiss().
  template <class Work>
  void serve(Work&& work) {
    for (;;) {
      go_.wait();
      if (dismissed_.load(std::memory_order_relaxed)) return;
      work();
      // Release: all that came of it is written before the asking thread can see the flag.
      done_.store(true, std::memory_order_release);
      if (awaited_) finished_.post();
    }
  }
  void dismiss() noexcept {
    dismissed_.store(true, std::memory_order_relaxed);
    go_.post();
  }

 private:
  const bool awaited_;
  bool under_way_ = false;  // the asking thread's own
  std::atomic<bool> done_{false};
  Wakeup go_;
  Wakeup finished_;
  // Relaxed throughout: the flag alone is the message, and the post of go_ that follows orders it.
  std::atomic<bool> dismissed_{false};
};

}  // namespace perimap
