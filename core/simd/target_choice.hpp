// Which of Highway's targets are compiled, and how one of them is chosen. For the kernels alone; include it
// before Highway.
#pragma once

// SSE4, AVX2 and AVX-512; besides them Highway always compiles the baseline of the compiler's flags. The rest would
// only cost build time, and so would all but AVX2 under AddressSanitizer: there the kernels take longer than anything
// else.
#ifdef PERIMAP_ADDRESS_SANITIZER
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3 | HWY_AVX3_DL)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#endif

#include <hwy/targets.h>

#include <mutex>

#include "core/simd/simd_target.hpp"

namespace perimap {

// Calls choose() while Highway's dynamic dispatch points to `target`. Highway keeps its choice for the whole process,
// so the lock keeps two that choose at once from taking each other's.
template <class Choose>
auto with_target(SimdTarget target, Choose choose) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  hwy::GetChosenTarget().Update(static_cast<std::int64_t>(target));
  const auto chosen = choose();
  hwy::GetChosenTarget().DeInit();
  return chosen;
}

}  // namespace perimap
