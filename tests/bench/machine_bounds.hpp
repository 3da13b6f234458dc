// What a pass over the covariances costs at least on this machine, whatever the program.
#pragma once

#include <cstddef>

namespace perimap::bench {

// Reads and writes an array (64-byte aligned, a multiple of 64 long) once, with one multiply-add an element.
void memory_pass(double* values, std::size_t count);

// Four multiply-adds for each of `count` elements (a multiple of 64) without touching memory: a pending update of rank
// 2 and M of one phase need so many. Returns their sum, which has no meaning.
[[nodiscard]] double arithmetic_pass(std::size_t count);

}  // namespace perimap::bench
