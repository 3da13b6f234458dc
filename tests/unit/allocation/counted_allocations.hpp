// Counts the calls of malloc in the whole program, operator new's included. Belongs in a test program's sources; brings
// a test of its own that the count works.
#pragma once

#include <atomic>

namespace perimap::test {

extern std::atomic<long> allocations;

template <class Function>
long allocations_of(Function function) {
  const long before = allocations.load();
  function();
  return allocations.load() - before;
}

}  // namespace perimap::test
