// The one place where the daemon's threads begin: their names, priorities, processors and stacks.
#pragma once

#include <perimap.h>

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace perimap {

struct SchedulingSettings {
  int priority = 0;       // SCHED_FIFO of the publisher, 1 to 98; 0: the normal scheduler for all
  std::vector<int> cpus;  // that real-time threads are pinned to; empty: any
};

// From the most to the least urgent.
enum class ThreadRole {
  kPublisher,     // the publisher's own priority; the last of the processors
  kSource,        // one below; any of the processors: it sleeps in the kernel
  kMapper,        // one below; the first of the processors
  kWorker,        // two below; worker i: processor i, round and round
  kHousekeeping,  // the normal scheduler, any processor of the machine
  kBackground     // likewise, behind whatever else is to be done (nice 10)
};

// Locks the process's memory, now and in future, so that no page fault waits for a disk; what is freed is kept for the
// next allocation. Refused without an unlimited RLIMIT_MEMLOCK: with a limit, later allocations would fail once it is
// reached.
[[nodiscard]] perimap_Privilege lock_memory(bool requested) noexcept;
// Whether it would be granted.
[[nodiscard]] bool memory_may_be_locked() noexcept;

// Launches from one thread; priority() from any.
class ThreadLauncher {
 public:
  explicit ThreadLauncher(SchedulingSettings settings) : settings_(std::move(settings)) {}

  // A thread that asks for what its role is to have and runs on without what is refused. At most 15 bytes of `name` are
  // shown by the system; `number` tells workers apart.
  [[nodiscard]] std::thread launch(std::string name, ThreadRole role, std::function<void()> body, int number = 0);

  // Whether every thread so far was given priority and processors.
  [[nodiscard]] perimap_Privilege priority() const noexcept;

 private:
  SchedulingSettings settings_;
  // Relaxed: a flag that announces nothing but itself.
  std::atomic<bool> refused_{false};
};

}  // namespace perimap
