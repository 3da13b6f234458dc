#include "daemon/runtime/privileges.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

namespace perimap {

perimap_Privilege lock_memory(bool requested) noexcept {
  if (!requested) return perimap_PRIVILEGE_NOT_REQUESTED;
  rlimit limit{};
  const bool unlimited = geteuid() == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
  if (!unlimited || mlockall(MCL_CURRENT | MCL_FUTURE) != 0) return perimap_PRIVILEGE_REFUSED;
  return perimap_PRIVILEGE_GRANTED;
}

bool apply(const ThreadRequest& request) noexcept {
  pthread_setname_np(pthread_self(), request.name.substr(0, 15).c_str());
  bool granted = true;
  if (!request.cpus.empty()) {
    cpu_set_t set;
    CPU_ZERO(&set);
    for (const int cpu : request.cpus) {
      if (cpu >= 0 && cpu < CPU_SETSIZE) CPU_SET(static_cast<unsigned>(cpu), &set);
    }
    granted = pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0;
  }
  if (request.priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = request.priority;
    granted = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0 && granted;
  }
  return granted;
}

}  // namespace perimap
