#include "daemon/runtime/thread_launcher.hpp"

#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

namespace perimap {
namespace {

constexpr std::size_t kTouchedStack = 256 * 1024;  // more than any real-time thread has been seen to use

constexpr int kBackgroundNice = 10;

// Never refused: a thread may always be nicer, and stays what it is where it is nicer already.
void step_back() noexcept {
  const auto self = static_cast<id_t>(gettid());
  setpriority(PRIO_PROCESS, self, std::max(getpriority(PRIO_PROCESS, self), kBackgroundNice));
}

// What one thread asks for.
struct ThreadRequest {
  int priority = 0;
  std::vector<int> cpus;
};

bool of_normal_scheduler(ThreadRole role) noexcept {
  return role == ThreadRole::kHousekeeping || role == ThreadRole::kBackground;
}

ThreadRequest request_for(const SchedulingSettings& settings, ThreadRole role, int number) {
  ThreadRequest request;
  if (settings.priority <= 0 || of_normal_scheduler(role)) return request;
  const int below = role == ThreadRole::kPublisher ? 0 : role == ThreadRole::kWorker ? 2 : 1;
  request.priority = std::max(1, settings.priority - below);
  const std::vector<int>& cpus = settings.cpus;
  if (cpus.empty()) return request;
  // One processor a thread: the scheduler does not move threads between isolated processors, and would leave all on
  // one.
  switch (role) {
    case ThreadRole::kPublisher:
      request.cpus = {cpus.back()};
      break;
    case ThreadRole::kMapper:
      request.cpus = {cpus.front()};
      break;
    case ThreadRole::kWorker:
      request.cpus = {cpus[static_cast<std::size_t>(number) % cpus.size()]};
      break;
    case ThreadRole::kSource:
    case ThreadRole::kHousekeeping:
    case ThreadRole::kBackground:
      request.cpus = cpus;
      break;
  }
  return request;
}

bool set_processors(const std::vector<int>& cpus) noexcept {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : cpus) {
    if (cpu >= 0 && cpu < CPU_SETSIZE) CPU_SET(static_cast<unsigned>(cpu), &set);
  }
  return pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0;
}

// For the calling thread. False when something was refused; a thread without priority may run on all the processors,
// since on a single one it could be kept waiting.
bool ask_for(const ThreadRequest& request, const std::vector<int>& all_cpus) noexcept {
  if (request.priority <= 0) return true;
  sched_param parameters{};
  parameters.sched_priority = request.priority;
  const bool prioritised = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
  // Without priority the kernel may round a sleep up by 50 us (prctl(2)).
  if (!prioritised) prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  if (request.cpus.empty()) return prioritised;
  return set_processors(prioritised ? request.cpus : all_cpus) && prioritised;
}

// Faults the stack's pages in before they are needed; without locked memory that is as good as it gets.
[[gnu::noinline]] void touch_stack() noexcept {
  std::byte stack[kTouchedStack];
  explicit_bzero(stack, sizeof stack);  // as memset, but never left out
}

}  // namespace

bool memory_may_be_locked() noexcept {
  rlimit limit{};
  return geteuid() == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
}

perimap_Privilege lock_memory(bool requested) noexcept {
  if (!requested) return perimap_PRIVILEGE_NOT_REQUESTED;
  if (!memory_may_be_locked() || mlockall(MCL_CURRENT | MCL_FUTURE) != 0) return perimap_PRIVILEGE_REFUSED;
  // NOLINTNEXTLINE(concurrency-mt-unsafe): before the other threads begin
  mallopt(M_TRIM_THRESHOLD, -1);
  return perimap_PRIVILEGE_GRANTED;
}

std::thread ThreadLauncher::launch(std::string name, ThreadRole role, std::function<void()> body, int number) {
  return std::thread(
      [this, name = std::move(name), request = request_for(settings_, role, number), role, body = std::move(body)] {
        pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
        if (!ask_for(request, settings_.cpus)) refused_.store(true, std::memory_order_relaxed);
        if (role == ThreadRole::kBackground) step_back();
        if (!of_normal_scheduler(role)) touch_stack();
        body();
      });
}

perimap_Privilege ThreadLauncher::priority() const noexcept {
  if (settings_.priority <= 0) return perimap_PRIVILEGE_NOT_REQUESTED;
  return refused_.load(std::memory_order_relaxed) ? perimap_PRIVILEGE_REFUSED : perimap_PRIVILEGE_GRANTED;
}

}  // namespace perimap
