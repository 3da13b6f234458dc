// How a long computation borrows its caller's threads: this folder creates none of its own.
#pragma once

#include <functional>

namespace perimap {

// Calls body(0) .. body(count - 1), each once, in any order and on any threads; returns when all have returned.
using ParallelFor = std::function<void(int count, const std::function<void(int)>& body)>;

inline void serial_for(int count, const std::function<void(int)>& body) {
  for (int i = 0; i < count; ++i) body(i);
}

}  // namespace perimap
