// What the real-time path must not call, counted while a thread is inside a RealtimeScope.
#pragma once

#include <string>

namespace perimap::test {

// Both interposed for the whole process, the C and C++ libraries included: allocation, locks by pthread_*, waits for a
// semaphore, a condition or a thread, sleeps, read, write, poll, fsync, sendmsg, recvmsg, and what goes by syscall().
// What glibc calls inside itself is not seen (its own streams, printf among them, but for what they allocate), nor are
// other system calls by name.
struct ForbiddenCalls {
  int heap = 0;
  int blocking = 0;
  std::string first_blocking;  // its name; empty: there was none
};

// Since the last call of forget_forbidden_calls().
[[nodiscard]] ForbiddenCalls forbidden_calls();
void forget_forbidden_calls() noexcept;

}  // namespace perimap::test
