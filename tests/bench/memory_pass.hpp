// Reads and writes an array once with the widest vectors of the machine and one multiply-add an element: what a pass
// over the covariances costs at least.
#pragma once

#include <cstddef>

namespace perimap::bench {

void memory_pass(double* values, std::size_t count);  // 64-byte aligned, a multiple of 64 long

}  // namespace perimap::bench
