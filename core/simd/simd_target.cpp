#include "core/simd/simd_target.hpp"

#include "core/simd/target_choice.hpp"

namespace perimap {

std::vector<SimdTarget> simd_targets() {
  const std::int64_t usable = hwy::SupportedTargets() & HWY_TARGETS;
  std::vector<SimdTarget> targets;
  // Better targets have lower bits.
  for (int bit = 0; bit < 63; ++bit) {
    if ((usable >> bit & 1) != 0) targets.push_back(SimdTarget{std::int64_t{1} << bit});
  }
  return targets;
}

const char* simd_target_name(SimdTarget target) { return hwy::TargetName(static_cast<std::int64_t>(target)); }

}  // namespace perimap
