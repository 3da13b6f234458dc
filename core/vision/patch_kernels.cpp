#include "core/vision/patch_kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/simd/target_choice.hpp"

#undef HWY_TARGET_INCLUDE
// Highway reads its name and compiles it once for each target.
#define HWY_TARGET_INCLUDE "core/vision/patch_kernels.cpp"  // NOLINT(cppcoreguidelines-macro-usage)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef PERIMAP_PATCH_KERNELS_ONCE
#define PERIMAP_PATCH_KERNELS_ONCE
namespace perimap {

// Column and row of each pixel of a square window, row after row.
struct WindowPlaces {
  explicit constexpr WindowPlaces(int side) {
    for (int i = 0; i < side * side; ++i) {
      column[static_cast<std::size_t>(i)] = static_cast<float>(i % side);
      row[static_cast<std::size_t>(i)] = static_cast<float>(i / side);
    }
  }
  alignas(64) std::array<float, PatchTemplate::kMaxSamples> column{};
  alignas(64) std::array<float, PatchTemplate::kMaxSamples> row{};
};

inline constexpr std::array<WindowPlaces, PatchTemplate::kLevels> kWindowPlaces = {
    WindowPlaces(PatchTemplate::kSide[0]), WindowPlaces(PatchTemplate::kSide[1]),
    WindowPlaces(PatchTemplate::kSide[2])};

inline const WindowPlaces& window_places(int side) noexcept {
  std::size_t l = 0;
  while (PatchTemplate::kSide[l] != side && l + 1 < kWindowPlaces.size()) ++l;
  return kWindowPlaces[l];
}

}  // namespace perimap
#endif

HWY_BEFORE_NAMESPACE();
namespace perimap::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Tag16 = hn::CappedTag<std::int16_t, 32>;
using Vector16 = hn::Vec<Tag16>;
#if HWY_TARGET == HWY_SCALAR
using Tag32 = hn::Rebind<std::int32_t, Tag16>;
#else
using Tag32 = hn::RepartitionToWide<Tag16>;
#endif
using Vector32 = hn::Vec<Tag32>;

constexpr int kLanes16 = static_cast<int>(hn::MaxLanes(Tag16()));

// sum + a b, neighbouring products added.
HWY_INLINE Vector32 add_products(Vector16 a, Vector16 b, Vector32 sum) noexcept {
  const Tag32 d;
#if HWY_TARGET == HWY_SCALAR
  return hn::Add(sum, hn::Mul(hn::PromoteTo(d, a), hn::PromoteTo(d, b)));
#else
  Vector32 unused = hn::Zero(d);
  sum = hn::ReorderWidenMulAccumulate(d, a, b, sum, unused);
  return hn::Add(sum, unused);  // zero on the targets with a pairwise multiply-add
#endif
}

HWY_INLINE std::int32_t total(Vector32 sum) noexcept { return hn::GetLane(hn::SumOfLanes(Tag32(), sum)); }

HWY_INLINE void clear_tail(int side, PatchSamples& samples) noexcept {
  const Tag16 d;
  for (int i = side * side; i < side * side + 32; i += kLanes16) hn::StoreU(hn::Zero(d), d, samples.grey.data() + i);
}

// kGreyScale times the grey values, interpolated along the row.
HWY_INLINE Vector16 sample_row(const std::uint8_t* p, Vector16 fraction) noexcept {
  const Tag16 d;
  const hn::Rebind<std::uint8_t, Tag16> d8;
  const Vector16 a = hn::ShiftLeft<4>(hn::PromoteTo(d, hn::LoadU(d8, p)));
  const Vector16 b = hn::ShiftLeft<4>(hn::PromoteTo(d, hn::LoadU(d8, p + 1)));
  return hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), fraction));
}

void sample_shifted(const GreyImage& image, int side, const Vector2d& first, PatchSamples& samples) noexcept {
  constexpr int kVectors = (PatchTemplate::kSide[0] + kLanes16 - 1) / kLanes16;
  constexpr int kReach = kVectors * kLanes16 + 1;
  constexpr int kLocalStride = 72;
  constexpr int kLocalRows = PatchTemplate::kSide[0] + 1;
  const Tag16 d;
  const int u = static_cast<int>(std::floor(first.x())), v = static_cast<int>(std::floor(first.y()));
  const auto fixed = [](double fraction) {
    return static_cast<std::int16_t>(std::min(32767.0, std::floor(32768.0 * fraction + 0.5)));
  };
  const Vector16 fu = hn::Set(d, fixed(first.x() - u)), fv = hn::Set(d, fixed(first.y() - v));

  const std::uint8_t* p = image.row(v) + u;
  std::ptrdiff_t stride = image.stride;
  // Whole vectors would reach beyond the last pixel: sample a copy.
  std::array<std::uint8_t, static_cast<std::size_t>(kLocalStride) * kLocalRows> local;
  if ((v + side) * image.stride + u + kReach > (image.height - 1) * image.stride + image.width) {
    local.fill(0);
    for (int y = 0; y <= side; ++y) {
      std::memcpy(local.data() + y * kLocalStride, p + y * stride, static_cast<std::size_t>(side) + 1);
    }
    p = local.data();
    stride = kLocalStride;
  }

  const int vectors = (side + kLanes16 - 1) / kLanes16;
  Vector16 above[kVectors];
  for (int k = 0; k < vectors; ++k) above[k] = sample_row(p + k * kLanes16, fu);
  const Vector16 origin = hn::Set(d, static_cast<std::int16_t>(kGreyScale * PatchTemplate::kGreyOrigin));
  std::int16_t* out = samples.grey.data();
  for (int y = 0; y < side; ++y) {
    p += stride;
    for (int k = 0; k < vectors; ++k) {
      const Vector16 below = sample_row(p + k * kLanes16, fu);
      const Vector16 grey = hn::Add(above[k], hn::MulFixedPoint15(hn::Sub(below, above[k]), fv));
      // What is stored beyond the row is overwritten by the next.
      hn::StoreU(hn::Sub(grey, origin), d, out + k * kLanes16);
      above[k] = below;
    }
    out += side;
  }
  clear_tail(side, samples);
}

using TagF = hn::CappedTag<float, 16>;
using VectorF = hn::Vec<TagF>;
using TagI = hn::RebindToSigned<TagF>;
using VectorI = hn::Vec<TagI>;

void sample_warped(const GreyImage& image, int side, const WindowGrid& grid, PatchSamples& samples) noexcept {
  const TagF df;
  const TagI di;
  const hn::Rebind<std::int16_t, TagF> d16;
  constexpr int kLanesF = static_cast<int>(hn::MaxLanes(TagF()));
  // Positions relative to a pixel left of and above the whole window are small enough for float.
  const double last = side - 1;
  const auto least = [last](double first, double a, double b) {
    return std::floor(first + std::min(0.0, last * a) + std::min(0.0, last * b));
  };
  const double base_u = std::max(0.0, least(grid.first.x(), grid.per_column.x(), grid.per_row.x()));
  const double base_v = std::max(0.0, least(grid.first.y(), grid.per_column.y(), grid.per_row.y()));
  const std::uint8_t* const base = image.row(static_cast<int>(base_v)) + static_cast<int>(base_u);
  const VectorF first_u = hn::Set(df, static_cast<float>(grid.first.x() - base_u));
  const VectorF first_v = hn::Set(df, static_cast<float>(grid.first.y() - base_v));
  const VectorF u_x = hn::Set(df, static_cast<float>(grid.per_column.x()));
  const VectorF v_x = hn::Set(df, static_cast<float>(grid.per_column.y()));
  const VectorF u_y = hn::Set(df, static_cast<float>(grid.per_row.x()));
  const VectorF v_y = hn::Set(df, static_cast<float>(grid.per_row.y()));
  const VectorI stride = hn::Set(di, static_cast<std::int32_t>(image.stride));
  const WindowPlaces& places = window_places(side);
  const int pixels = side * side;

  // In three passes, so that no vector is read right after its elements were written one by one, which stalls.
  constexpr std::size_t kRoom = PatchTemplate::kMaxSamples;
  HWY_ALIGN std::array<float, kRoom> fractions_u, fractions_v;
  HWY_ALIGN std::array<std::int32_t, kRoom> offsets;
  for (int i = 0; i < pixels; i += kLanesF) {
    const VectorF x = hn::Load(df, places.column.data() + i);
    const VectorF y = hn::Load(df, places.row.data() + i);
    // Not fused: the same values on every target.
    const VectorF u = hn::Max(hn::Zero(df), hn::Add(first_u, hn::Add(hn::Mul(u_x, x), hn::Mul(u_y, y))));
    const VectorF v = hn::Max(hn::Zero(df), hn::Add(first_v, hn::Add(hn::Mul(v_x, x), hn::Mul(v_y, y))));
    const VectorI u_0 = hn::ConvertTo(di, u), v_0 = hn::ConvertTo(di, v);
    hn::Store(hn::Sub(u, hn::ConvertTo(df, u_0)), df, fractions_u.data() + i);
    hn::Store(hn::Sub(v, hn::ConvertTo(df, v_0)), df, fractions_v.data() + i);
    hn::Store(hn::Add(hn::Mul(v_0, stride), u_0), di, offsets.data() + i);
  }

  // The four neighbours of each, upper left lowest. Scalar loads: gathers take longer on the machines measured.
  HWY_ALIGN std::array<std::uint32_t, kRoom> neighbours;
  for (int i = 0; i < (pixels + kLanesF - 1) / kLanesF * kLanesF; ++i) {
    const std::uint8_t* const p = base + offsets[static_cast<std::size_t>(i)];
    std::uint16_t above, below;
    std::memcpy(&above, p, sizeof above);
    std::memcpy(&below, p + image.stride, sizeof below);
    neighbours[static_cast<std::size_t>(i)] = above | static_cast<std::uint32_t>(below) << 16;
  }

  const hn::RebindToUnsigned<TagI> du;
  const auto byte = hn::Set(du, 255U);
  const auto grey_of = [&](hn::Vec<decltype(du)> low_byte)
                           HWY_ATTR { return hn::ConvertTo(df, hn::BitCast(di, low_byte)); };
  for (int i = 0; i < pixels; i += kLanesF) {
    const auto four = hn::Load(du, neighbours.data() + i);
    const VectorF fu = hn::Load(df, fractions_u.data() + i), fv = hn::Load(df, fractions_v.data() + i);
    const VectorF a_0 = grey_of(hn::And(four, byte));
    const VectorF a_1 = grey_of(hn::And(hn::ShiftRight<8>(four), byte));
    const VectorF b_0 = grey_of(hn::And(hn::ShiftRight<16>(four), byte));
    const VectorF b_1 = grey_of(hn::ShiftRight<24>(four));
    const VectorF a = hn::Add(a_0, hn::Mul(fu, hn::Sub(a_1, a_0)));
    const VectorF b = hn::Add(b_0, hn::Mul(fu, hn::Sub(b_1, b_0)));
    const VectorF grey = hn::Add(a, hn::Mul(fv, hn::Sub(b, a)));
    const VectorF scaled = hn::Mul(hn::Sub(grey, hn::Set(df, static_cast<float>(PatchTemplate::kGreyOrigin))),
                                   hn::Set(df, static_cast<float>(kGreyScale)));
    hn::StoreU(hn::DemoteTo(d16, hn::NearestInt(scaled)), d16, samples.grey.data() + i);
  }
  clear_tail(side, samples);
}

// What sum and sum_affine share; kMoments is 0 or 4.
template <int kMoments>
HWY_INLINE void accumulate(const PatchTemplate::Level& level, const std::array<PatchTemplate::Pixels, 4>* moments,
                           const PatchSamples& samples, PatchSums& sums) noexcept {
  const Tag16 d;
  const Tag32 d32;
  const Vector16 ones = hn::Set(d, std::int16_t{1});
  Vector32 grey = hn::Zero(d32), squared = hn::Zero(d32), value = hn::Zero(d32);
  Vector32 x = hn::Zero(d32), y = hn::Zero(d32);
  Vector32 moment[4] = {hn::Zero(d32), hn::Zero(d32), hn::Zero(d32), hn::Zero(d32)};
  for (int i = 0; i < level.side * level.side; i += kLanes16) {
    const Vector16 seen = hn::Load(d, samples.grey.data() + i);
    grey = add_products(seen, ones, grey);
    squared = add_products(seen, seen, squared);
    value = add_products(seen, hn::Load(d, level.value.data() + i), value);
    x = add_products(seen, hn::Load(d, level.gradient_x.data() + i), x);
    y = add_products(seen, hn::Load(d, level.gradient_y.data() + i), y);
    if constexpr (kMoments > 0) {
      for (std::size_t m = 0; m < kMoments; ++m) {
        moment[m] = add_products(seen, hn::Load(d, (*moments)[m].data() + i), moment[m]);
      }
    }
  }
  sums.grey = total(grey);
  sums.grey_squared = total(squared);
  sums.with_template = total(value);
  sums.with_gradient_x = total(x);
  sums.with_gradient_y = total(y);
  for (std::size_t m = 0; m < kMoments; ++m) sums.with_moments[m] = total(moment[m]);
}

void sum(const PatchTemplate::Level& level, const PatchSamples& samples, PatchSums& sums) noexcept {
  accumulate<0>(level, nullptr, samples, sums);
}

void sum_affine(const PatchTemplate& patch, const PatchSamples& samples, PatchSums& sums) noexcept {
  accumulate<4>(patch.levels[0], &patch.gradient_moments, samples, sums);
}

void correlate(const SearchPattern& pattern, const std::int16_t* first, int stride, SearchSums& sums) noexcept {
  const hn::CappedTag<std::int16_t, 16> d;
#if HWY_TARGET == HWY_SCALAR
  const hn::Rebind<std::int32_t, decltype(d)> d32;
#else
  const hn::RepartitionToWide<decltype(d)> d32;
#endif
  const auto add = [&](auto a, auto b, auto sum_so_far) HWY_ATTR {
#if HWY_TARGET == HWY_SCALAR
    return hn::Add(sum_so_far, hn::Mul(hn::PromoteTo(d32, a), hn::PromoteTo(d32, b)));
#else
    auto unused = hn::Zero(d32);
    sum_so_far = hn::ReorderWidenMulAccumulate(d32, a, b, sum_so_far, unused);
    return hn::Add(sum_so_far, unused);
#endif
  };
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto ones = hn::Set(d, std::int16_t{1});
  auto grey = hn::Zero(d32), squared = hn::Zero(d32), value = hn::Zero(d32);
  for (int y = 0; y < pattern.side; ++y) {
    const std::int16_t* const row = first + y * stride;
    const std::int16_t* const row_value = pattern.value.data() + y * SearchPattern::kStride;
    const std::int16_t* const row_mask = pattern.mask.data() + y * SearchPattern::kStride;
    for (int x = 0; x < pattern.side; x += lanes) {
      const auto seen = hn::And(hn::LoadU(d, row + x), hn::Load(d, row_mask + x));
      grey = add(seen, ones, grey);
      squared = add(seen, seen, squared);
      value = add(seen, hn::Load(d, row_value + x), value);
    }
  }
  sums.grey = hn::GetLane(hn::SumOfLanes(d32, grey));
  sums.grey_squared = hn::GetLane(hn::SumOfLanes(d32, squared));
  sums.with_value = hn::GetLane(hn::SumOfLanes(d32, value));
}

template <int kLevel>
HWY_INLINE void reduce_row(const std::uint8_t* from, std::ptrdiff_t stride, int width, std::uint8_t* out) noexcept {
  constexpr int kBlock = 1 << kLevel;
  int x = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::CappedTag<std::uint8_t, 32> d8;
  const hn::RepartitionToWide<decltype(d8)> d16;
  const int blocks = static_cast<int>(hn::Lanes(d8)) / kBlock;
  while (width >= blocks && x < width) {
    x = std::min(x, width - blocks);  // the last vector overlaps the one before
    auto pairs = hn::Zero(d16);
    for (int y = 0; y < kBlock; ++y) {
      const auto bytes = hn::BitCast(d16, hn::LoadU(d8, from + y * stride + kBlock * x));
      pairs = hn::Add(pairs, hn::Add(hn::And(bytes, hn::Set(d16, std::uint16_t{255})), hn::ShiftRight<8>(bytes)));
    }
    if constexpr (kLevel == 1) {
      const hn::RebindToSigned<decltype(d16)> di16;
      const hn::Rebind<std::uint8_t, decltype(d16)> out_tag;
      const auto mean = hn::ShiftRight<2>(hn::Add(pairs, hn::Set(d16, std::uint16_t{2})));
      hn::StoreU(hn::DemoteTo(out_tag, hn::BitCast(di16, mean)), out_tag, out + x);
    } else {
      const hn::RepartitionToWide<decltype(d16)> d32;
      const hn::RebindToSigned<decltype(d32)> di32;
      const hn::Rebind<std::uint8_t, decltype(d32)> out_tag;
      const auto words = hn::BitCast(d32, pairs);
      const auto fours = hn::Add(hn::And(words, hn::Set(d32, 0xFFFFU)), hn::ShiftRight<16>(words));
      const auto mean = hn::ShiftRight<4>(hn::Add(fours, hn::Set(d32, 8U)));
      hn::StoreU(hn::DemoteTo(out_tag, hn::BitCast(di32, mean)), out_tag, out + x);
    }
    x += blocks;
  }
#endif
  for (; x < width; ++x) {
    int block = 0;
    for (int y = 0; y < kBlock; ++y) {
      for (int k = 0; k < kBlock; ++k) block += from[y * stride + kBlock * x + k];
    }
    out[x] = static_cast<std::uint8_t>((block + kBlock * kBlock / 2) >> (2 * kLevel));
  }
}

void reduce(const GreyImage& image, int level, int left, int top, int width, int height, std::uint8_t* out) noexcept {
  for (int y = 0; y < height; ++y, out += width) {
    const std::uint8_t* const from = image.row((top + y) << level) + (left << level);
    if (level == 1) {
      reduce_row<1>(from, image.stride, width, out);
    } else {
      reduce_row<2>(from, image.stride, width, out);
    }
  }
}

const PatchKernels* patch_kernel_table() {
  static constexpr PatchKernels kTable{&sample_shifted, &sample_warped, &sum, &sum_affine, &correlate, &reduce};
  return &kTable;
}

}  // namespace perimap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace perimap {

HWY_EXPORT(patch_kernel_table);

const PatchKernels& patch_kernels(SimdTarget target) {
  return *with_target(target, [] { return HWY_DYNAMIC_DISPATCH(patch_kernel_table)(); });
}

}  // namespace perimap
#endif
