#include "machine_bounds.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "machine_bounds.cpp"
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

double multiply_adds(std::size_t count) {
  const hn::ScalableTag<double> tag;
  const auto shrink = hn::Set(tag, 0.999);
  // Twelve chains: more than latency times throughput of any machine, and few enough for sixteen registers.
  // All begin differently, or the compiler would see that they are one.
  const auto start = [&](double value) HWY_ATTR { return hn::Set(tag, value); };
  auto a = start(1), b = start(2), c = start(3), d = start(4), e = start(5), f = start(6);
  auto g = start(7), h = start(8), k = start(9), l = start(10), m = start(11), n = start(12);
  for (std::size_t i = 0; i < count; i += 3 * hn::Lanes(tag)) {
    a = hn::MulAdd(a, shrink, shrink);
    b = hn::MulAdd(b, shrink, shrink);
    c = hn::MulAdd(c, shrink, shrink);
    d = hn::MulAdd(d, shrink, shrink);
    e = hn::MulAdd(e, shrink, shrink);
    f = hn::MulAdd(f, shrink, shrink);
    g = hn::MulAdd(g, shrink, shrink);
    h = hn::MulAdd(h, shrink, shrink);
    k = hn::MulAdd(k, shrink, shrink);
    l = hn::MulAdd(l, shrink, shrink);
    m = hn::MulAdd(m, shrink, shrink);
    n = hn::MulAdd(n, shrink, shrink);
  }
  const auto sum = hn::Add(hn::Add(hn::Add(a, b), hn::Add(c, d)), hn::Add(hn::Add(e, f), hn::Add(g, h)));
  return hn::GetLane(hn::Add(sum, hn::Add(hn::Add(k, l), hn::Add(m, n))));
}

}  // namespace HWY_NAMESPACE
}  // namespace perimap::bench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace perimap::bench {
HWY_EXPORT(pass);
HWY_EXPORT(multiply_adds);
void memory_pass(double* values, std::size_t count) { HWY_DYNAMIC_DISPATCH(pass)(values, count); }
double arithmetic_pass(std::size_t count) { return HWY_DYNAMIC_DISPATCH(multiply_adds)(count); }
}  // namespace perimap::bench
#endif
