// Which instruction set kernels run on. They are compiled for several (Highway's dynamic dispatch); who uses them takes
// the best that the machine has, or the one it is told to.
#pragma once

#include <cstdint>
#include <vector>

namespace perimap {

// One instruction set, by Highway's bit.
enum class SimdTarget : std::int64_t {};

// Those that are both compiled in and on this machine, best first; never empty.
[[nodiscard]] std::vector<SimdTarget> simd_targets();
[[nodiscard]] inline SimdTarget best_simd_target() { return simd_targets().front(); }

// "AVX3" (AVX-512), "AVX2", "SSE4", or "SCALAR".
[[nodiscard]] const char* simd_target_name(SimdTarget target);

}  // namespace perimap
