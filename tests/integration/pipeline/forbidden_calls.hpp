// What the real-time path must not call, counted while a thread is inside a RealtimeScope.
#pragma once

#include <string>

namespace perimap::test {

// Both interposed for the whole process, the C and C++ libraries included. What glibc calls inside itself is not seen,
// but every way there is: a lock by pthread_*, a wait by its semaphore, condition or futex, a system call by name or by
// syscall().
struct ForbiddenCalls {
  int heap = 0;
  int blocking = 0;
  std::string first_blocking;  // its name; empty: there was none
};

// Since the last call of forget_forbidden_calls().
[[nodiscard]] ForbiddenCalls forbidden_calls();
void forget_forbidden_calls() noexcept;

}  // namespace perimap::test
