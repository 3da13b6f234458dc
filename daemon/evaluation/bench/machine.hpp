// What a benchmark ran on.
#pragma once

#include <string>

namespace perimap::bench {

struct Machine {
  std::string processor;
  unsigned processors = 0;
  std::string kernel;
  std::string governor;  // "unknown" where the kernel does not say, as in most virtual machines
  bool virtual_machine = false;
  bool realtime_permitted = false;  // SCHED_FIFO for this process
  bool memory_lock_permitted = false;
  double load_1_min = 0.0;  // when asked: what others want of the machine is not known otherwise
  std::string build;        // compiler, and whether optimised and with assertions
};

[[nodiscard]] Machine this_machine();
[[nodiscard]] double load_1_min();

}  // namespace perimap::bench
