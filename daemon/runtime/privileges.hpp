// What the operating system lets a real-time process have, and whether it was given.
#pragma once

#include <perimap.h>

#include <atomic>
#include <string>
#include <vector>

namespace perimap {

// Locks the process's memory now and in future, so that no page fault waits for a disk. Refused without an unlimited
// RLIMIT_MEMLOCK: with a limit, later allocations would fail once it is reached.
[[nodiscard]] perimap_Privilege lock_memory(bool requested) noexcept;

// What a thread asks for when it starts.
struct ThreadRequest {
  std::string name;       // at most 15 bytes are shown by the system
  int priority = 0;       // SCHED_FIFO, 1 to 98; 0: the normal scheduler
  std::vector<int> cpus;  // empty: any
};

// For the calling thread. False when the priority or the affinity was refused; it then runs on without.
[[nodiscard]] bool apply(const ThreadRequest& request) noexcept;

}  // namespace perimap
