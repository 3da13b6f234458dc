#include "memory_pass.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "memory_pass.cpp"
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace perimap::bench {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void pass(double* values, std::size_t count) {
  const hn::ScalableTag<double> tag;
  const auto shrink = hn::Set(tag, 0.999);
  const std::size_t lanes = hn::Lanes(tag);
  for (std::size_t i = 0; i < count; i += 4 * lanes) {
    for (std::size_t k = 0; k < 4; ++k) {
      double* at = values + i + k * lanes;
      hn::Store(hn::MulAdd(hn::Load(tag, at), shrink, shrink), tag, at);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace perimap::bench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace perimap::bench {
HWY_EXPORT(pass);
void memory_pass(double* values, std::size_t count) { HWY_DYNAMIC_DISPATCH(pass)(values, count); }
}  // namespace perimap::bench
#endif
