#include "tests/integration/pipeline/forbidden_calls.hpp"

#include <dlfcn.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <ctime>

#include "core/realtime/realtime_scope.hpp"

namespace {

std::atomic<int> heap_calls{0};
std::atomic<int> blocking_calls{0};
std::atomic<const char*> first_blocking{nullptr};

void count_heap() noexcept {
  if (perimap::RealtimeScope::depth() > 0) heap_calls.fetch_add(1);
}

void count_blocking(const char* name) noexcept {
  if (perimap::RealtimeScope::depth() == 0) return;
  blocking_calls.fetch_add(1);
  const char* none = nullptr;
  first_blocking.compare_exchange_strong(none, name);
}

// The function that this one stands before. On x86-64 glibc has two of each of the conditions, and gives the older one
// to whom asks without a version.
void* behind(const char* name) noexcept {
  void* found = dlvsym(RTLD_NEXT, name, "GLIBC_2.3.2");
  return found != nullptr ? found : dlsym(RTLD_NEXT, name);
}

// Calls it. What is found is kept; two threads that look for it at once find the same.
#define PERIMAP_PASS_ON(name, ...)                       \
  count_blocking(#name);                                 \
  static std::atomic<void*> real{nullptr};               \
  if (real.load() == nullptr) real.store(behind(#name)); \
  return reinterpret_cast<decltype(&(name))>(real.load())(__VA_ARGS__)

}  // namespace

namespace perimap::test {

ForbiddenCalls forbidden_calls() {
  const char* name = first_blocking.load();
  return {heap_calls.load(), blocking_calls.load(), name != nullptr ? name : ""};
}

void forget_forbidden_calls() noexcept {
  heap_calls = 0;
  blocking_calls = 0;
  first_blocking = nullptr;
}

}  // namespace perimap::test

extern "C" {

// ---- the heap: glibc's own allocator under its other names (malloc.h, "Replacing malloc", glibc manual)
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t n) {
  count_heap();
  return __libc_malloc(n);
}
void* calloc(std::size_t n, std::size_t size) {
  count_heap();
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t n) {
  count_heap();
  return __libc_realloc(p, n);
}
void* memalign(std::size_t alignment, std::size_t n) {
  count_heap();
  return __libc_memalign(alignment, n);
}
void* aligned_alloc(std::size_t alignment, std::size_t n) {
  count_heap();
  return __libc_memalign(alignment, n);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t n) {
  count_heap();
  *out = __libc_memalign(alignment, n);
  return *out == nullptr ? ENOMEM : 0;
}
void free(void* p) {
  if (p != nullptr) count_heap();
  __libc_free(p);
}

// ---- locks and waits
int pthread_mutex_lock(pthread_mutex_t* mutex) { PERIMAP_PASS_ON(pthread_mutex_lock, mutex); }
int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) {
  PERIMAP_PASS_ON(pthread_mutex_timedlock, mutex, until);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) { PERIMAP_PASS_ON(pthread_rwlock_rdlock, lock); }
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) { PERIMAP_PASS_ON(pthread_rwlock_wrlock, lock); }
int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  PERIMAP_PASS_ON(pthread_cond_wait, condition, mutex);
}
int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* until) {
  PERIMAP_PASS_ON(pthread_cond_timedwait, condition, mutex, until);
}
int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock, const timespec* until) {
  PERIMAP_PASS_ON(pthread_cond_clockwait, condition, mutex, clock, until);
}
int pthread_join(pthread_t thread, void** result) { PERIMAP_PASS_ON(pthread_join, thread, result); }
int sem_wait(sem_t* semaphore) { PERIMAP_PASS_ON(sem_wait, semaphore); }
int sem_timedwait(sem_t* semaphore, const timespec* until) { PERIMAP_PASS_ON(sem_timedwait, semaphore, until); }
int sem_clockwait(sem_t* semaphore, clockid_t clock, const timespec* until) {
  PERIMAP_PASS_ON(sem_clockwait, semaphore, clock, until);
}
int nanosleep(const timespec* time, timespec* left) { PERIMAP_PASS_ON(nanosleep, time, left); }
int clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec* left) {
  PERIMAP_PASS_ON(clock_nanosleep, clock, flags, time, left);
}

// ---- input and output
ssize_t read(int fd, void* bytes, std::size_t n) { PERIMAP_PASS_ON(read, fd, bytes, n); }
ssize_t write(int fd, const void* bytes, std::size_t n) { PERIMAP_PASS_ON(write, fd, bytes, n); }
int fsync(int fd) { PERIMAP_PASS_ON(fsync, fd); }
int poll(pollfd* fds, nfds_t n, int milliseconds) { PERIMAP_PASS_ON(poll, fds, n, milliseconds); }
ssize_t sendmsg(int fd, const msghdr* message, int flags) { PERIMAP_PASS_ON(sendmsg, fd, message, flags); }
ssize_t recvmsg(int fd, msghdr* message, int flags) { PERIMAP_PASS_ON(recvmsg, fd, message, flags); }

// ---- any system call by its number: the futex of std::atomic::wait() among them
long syscall(long number, ...) {
  std::va_list list;
  va_start(list, number);
  long arguments[6];
  for (long& argument : arguments) argument = va_arg(list, long);
  va_end(list);
  PERIMAP_PASS_ON(syscall, number, arguments[0], arguments[1], arguments[2], arguments[3], arguments[4], arguments[5]);
}
}
