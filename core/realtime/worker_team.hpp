// Runs one function on several worker threads at once and waits for all of them.
#pragma once

#include <memory>

#include "core/realtime/realtime_scope.hpp"
#include "core/realtime/wakeup.hpp"

namespace perimap {

// The leader (the mapper thread) calls start() and join(); each worker thread, created elsewhere, spends its life in
// serve(). Nothing is allocated after construction. The order of memory: everything that the leader wrote before
// start() is visible to the workers, and everything they wrote is visible to the leader after join(); both by the
// semaphores (post synchronises with wait, POSIX "memory synchronisation").
class WorkerTeam {
 public:
  using Task = void (*)(void* context, int worker) noexcept;

  explicit WorkerTeam(int workers)
      : size_(workers), go_(std::make_unique<Wakeup[]>(static_cast<std::size_t>(workers))) {}

  [[nodiscard]] int size() const noexcept { return size_; }

  // Leader. The previous start() must have been joined.
  void start(Task task, void* context) noexcept {
    task_ = task;
    context_ = context;
    pending_ = size_;
    for (int i = 0; i < size_; ++i) go_[static_cast<std::size_t>(i)].post();
  }

  // Leader. Returns when every worker has finished; at once when nothing was started.
  void join() noexcept {
    const NamedWait wait;
    for (; pending_ > 0; --pending_) done_.wait();
  }

  void run(Task task, void* context) noexcept {
    start(task, context);
    join();
  }

  // Worker number `worker`, 0 to size()-1: serves tasks until dismiss().
  void serve(int worker) noexcept {
    for (;;) {
      go_[static_cast<std::size_t>(worker)].wait();
      if (task_ == nullptr) return;
      task_(context_, worker);
      done_.post();
    }
  }

  // Leader: the workers return from serve().
  void dismiss() noexcept {
    join();
    task_ = nullptr;
    for (int i = 0; i < size_; ++i) go_[static_cast<std::size_t>(i)].post();
  }

 private:
  int size_;
  std::unique_ptr<Wakeup[]> go_;
  Wakeup done_;
  int pending_ = 0;  // the leader's own
  Task task_ = nullptr;
  void* context_ = nullptr;
};

}  // namespace perimap
