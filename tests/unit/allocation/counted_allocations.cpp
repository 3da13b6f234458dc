#include "counted_allocations.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

namespace perimap::test {

std::atomic<long> allocations{0};

}  // namespace perimap::test

using perimap::test::allocations;

#ifdef PERIMAP_SANITIZER
// The sanitizers own malloc, and tell of its calls.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*malloc_hook)(const volatile void*, std::size_t),
                                                         void (*free_hook)(const volatile void*));
namespace {
[[maybe_unused]] const int kHooks = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { allocations.fetch_add(1, std::memory_order_relaxed); },
    [](const volatile void*) {});
}  // namespace
#else
// operator new ends here too.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
#endif

namespace perimap::test {
namespace {

TEST(Allocation, IsCounted) {
  void* volatile taken = nullptr;
  EXPECT_GT(allocations_of([&] { taken = std::malloc(100); }), 0);
  std::free(taken);
  int* volatile made = nullptr;
  EXPECT_GT(allocations_of([&] { made = new int[50]; }), 0);
  delete[] made;
}

}  // namespace
}  // namespace perimap::test
