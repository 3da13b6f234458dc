#include "daemon/evaluation/bench/machine.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/utsname.h>

#include <fstream>
#include <thread>

#include "daemon/runtime/thread_launcher.hpp"

namespace perimap::bench {
namespace {

std::string first_line(const char* path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line.empty() ? "unknown" : line;
}

// What follows the first line's colon that begins with `key`; empty when there is none.
std::string cpu_fact(const std::string& key) {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with(key) && colon != std::string::npos) return line.substr(colon + 2);
  }
  return {};
}

// Tried on a thread of its own, so that nothing of this one changes.
bool may_be_realtime() {
  bool granted = false;
  std::thread([&granted] {
    sched_param parameters{};
    parameters.sched_priority = 1;
    granted = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
  }).join();
  return granted;
}

}  // namespace

double load_1_min() {
  double load = 0.0;
  std::ifstream("/proc/loadavg") >> load;
  return load;
}

Machine this_machine() {
  Machine machine;
  machine.processor = cpu_fact("model name");
  machine.processors = std::thread::hardware_concurrency();
  utsname system{};
  uname(&system);
  machine.kernel = std::string(system.sysname) + " " + system.release + " " + system.version;
  machine.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  machine.virtual_machine = (" " + cpu_fact("flags") + " ").find(" hypervisor ") != std::string::npos;
  machine.realtime_permitted = may_be_realtime();
  machine.memory_lock_permitted = memory_may_be_locked();
  machine.load_1_min = load_1_min();
  machine.build = "GCC " __VERSION__;
#ifdef __OPTIMIZE__
  machine.build += ", optimised";
#else
  machine.build += ", not optimised";
#endif
#ifdef NDEBUG
  machine.build += ", without assertions";
#else
  machine.build += ", with assertions";
#endif
  return machine;
}

}  // namespace perimap::bench
