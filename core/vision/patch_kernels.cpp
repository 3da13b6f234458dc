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

static_assert(PatchTemplate::kGreyScale == 16, "sample_row shifts by 4");

// Weights of the pixels before and behind the nearest one, which is `from_nearest` away, [-1/2, 1/2).
struct SplineWeights {
  double before, behind;
};
HWY_INLINE SplineWeights spline_weights(double from_nearest) noexcept {
  const auto half_square = [](double x) { return 0.5 * x * x; };
  return {half_square(0.5 - from_nearest), half_square(0.5 + from_nearest)};
}

HWY_INLINE Vector16 blend(Vector16 before, Vector16 nearest, Vector16 behind, Vector16 weight_before,
                          Vector16 weight_behind) noexcept {
  return hn::Add(nearest, hn::Add(hn::MulFixedPoint15(hn::Sub(before, nearest), weight_before),
                                  hn::MulFixedPoint15(hn::Sub(behind, nearest), weight_behind)));
}

// kGreyScale times the grey values along the row, from the pixel before the nearest one on.
HWY_INLINE Vector16 sample_row(const std::uint8_t* p, Vector16 weight_before, Vector16 weight_behind) noexcept {
  const Tag16 d;
  const hn::Rebind<std::uint8_t, Tag16> d8;
  const auto grey = [&](const std::uint8_t* at)
                        HWY_ATTR { return hn::ShiftLeft<4>(hn::PromoteTo(d, hn::LoadU(d8, at))); };
  return blend(grey(p), grey(p + 1), grey(p + 2), weight_before, weight_behind);
}

void sample_shifted(const GreyImage& image, int side, const Vector2d& first, PatchSamples& samples) noexcept {
  constexpr int kVectors = (PatchTemplate::kSide[0] + kLanes16 - 1) / kLanes16;
  constexpr int kReach = kVectors * kLanes16 + 2;
  constexpr int kLocalStride = 72;
  constexpr int kLocalRows = PatchTemplate::kSide[0] + 2;
  const Tag16 d;
  const int u = static_cast<int>(std::floor(first.x() + 0.5)), v = static_cast<int>(std::floor(first.y() + 0.5));
  const auto fixed = [d](double weight)
                         HWY_ATTR { return hn::Set(d, static_cast<std::int16_t>(std::floor(32768.0 * weight + 0.5))); };
  const SplineWeights across = spline_weights(first.x() - u), down = spline_weights(first.y() - v);
  const Vector16 left = fixed(across.before), right = fixed(across.behind);
  const Vector16 upper = fixed(down.before), lower = fixed(down.behind);

  const std::uint8_t* p = image.row(v - 1) + u - 1;
  std::ptrdiff_t stride = image.stride;
  // Whole vectors would reach beyond the last pixel: sample a copy.
  std::uint8_t local[static_cast<std::size_t>(kLocalStride) * kLocalRows];
  if ((v + side) * image.stride + u - 1 + kReach > (image.height - 1) * image.stride + image.width) {
    std::memset(local, 0, sizeof local);
    for (int y = 0; y < side + 2; ++y) {
      std::memcpy(local + y * kLocalStride, p + y * stride, static_cast<std::size_t>(side) + 2);
    }
    p = local;
    stride = kLocalStride;
  }

  const int vectors = (side + kLanes16 - 1) / kLanes16;
  Vector16 above[kVectors], here[kVectors];
  for (int k = 0; k < vectors; ++k) {
    above[k] = sample_row(p + k * kLanes16, left, right);
    here[k] = sample_row(p + stride + k * kLanes16, left, right);
  }
  p += stride;
  const Vector16 origin = hn::Set(d, static_cast<std::int16_t>(PatchTemplate::kGreyScale * PatchTemplate::kGreyOrigin));
  std::int16_t* out = samples.grey.data();
  for (int y = 0; y < side; ++y) {
    p += stride;
    for (int k = 0; k < vectors; ++k) {
      const Vector16 below = sample_row(p + k * kLanes16, left, right);
      const Vector16 grey = blend(above[k], here[k], below, upper, lower);
      // What is stored beyond the row is overwritten by the next.
      hn::StoreU(hn::Sub(grey, origin), d, out + k * kLanes16);
      above[k] = here[k];
      here[k] = below;
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
  // Positions relative to a pixel left of and above the whole window are small enough for float; its own neighbours are
  // in the image.
  const double last = side - 1;
  const auto least = [last](double first, double a, double b) {
    return std::floor(first + std::min(0.0, last * a) + std::min(0.0, last * b));
  };
  const double base_u = std::max(1.0, least(grid.first.x(), grid.per_column.x(), grid.per_row.x()));
  const double base_v = std::max(1.0, least(grid.first.y(), grid.per_column.y(), grid.per_row.y()));
  const std::uint8_t* const base = image.row(static_cast<int>(base_v) - 1) + static_cast<int>(base_u) - 1;
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
  HWY_ALIGN float from_nearest_u[kRoom], from_nearest_v[kRoom];
  HWY_ALIGN std::int32_t offsets[kRoom];
  const VectorF half = hn::Set(df, 0.5F);
  for (int i = 0; i < pixels; i += kLanesF) {
    const VectorF x = hn::Load(df, places.column.data() + i);
    const VectorF y = hn::Load(df, places.row.data() + i);
    // Not fused: the same values on every target.
    const VectorF u = hn::Max(hn::Zero(df), hn::Add(first_u, hn::Add(hn::Mul(u_x, x), hn::Mul(u_y, y))));
    const VectorF v = hn::Max(hn::Zero(df), hn::Add(first_v, hn::Add(hn::Mul(v_x, x), hn::Mul(v_y, y))));
    const VectorI u_0 = hn::ConvertTo(di, hn::Add(u, half)), v_0 = hn::ConvertTo(di, hn::Add(v, half));
    hn::Store(hn::Sub(u, hn::ConvertTo(df, u_0)), df, from_nearest_u + i);
    hn::Store(hn::Sub(v, hn::ConvertTo(df, v_0)), df, from_nearest_v + i);
    hn::Store(hn::Add(hn::Mul(v_0, stride), u_0), di, offsets + i);
  }

  // The nine around each, in three rows, the left one lowest; the fourth byte is not used. Scalar loads: gathers take
  // longer on the machines measured.
  HWY_ALIGN std::uint32_t above[kRoom], here[kRoom], below[kRoom];
  for (int i = 0; i < (pixels + kLanesF - 1) / kLanesF * kLanesF; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const std::uint8_t* const p = base + offsets[at];
    std::memcpy(&above[at], p, sizeof above[at]);
    std::memcpy(&here[at], p + image.stride, sizeof here[at]);
    std::memcpy(&below[at], p + 2 * static_cast<std::ptrdiff_t>(image.stride), sizeof below[at]);
  }

  const hn::RebindToUnsigned<TagI> du;
  const auto byte = hn::Set(du, 255U);
  const auto grey_of = [&](hn::Vec<decltype(du)> low_byte)
                           HWY_ATTR { return hn::ConvertTo(df, hn::BitCast(di, low_byte)); };
  const auto blend = [&](VectorF before, VectorF nearest, VectorF behind, VectorF weight_before, VectorF weight_behind)
                         HWY_ATTR {
                           return hn::Add(nearest, hn::Add(hn::Mul(hn::Sub(before, nearest), weight_before),
                                                           hn::Mul(hn::Sub(behind, nearest), weight_behind)));
                         };
  for (int i = 0; i < pixels; i += kLanesF) {
    const auto weight_of = [&](VectorF distance) HWY_ATTR { return hn::Mul(half, hn::Mul(distance, distance)); };
    const VectorF u = hn::Load(df, from_nearest_u + i), v = hn::Load(df, from_nearest_v + i);
    const VectorF left = weight_of(hn::Sub(half, u)), right = weight_of(hn::Add(half, u));
    const auto across = [&](const std::uint32_t* row) HWY_ATTR {
      const auto three = hn::Load(du, row + i);
      return blend(grey_of(hn::And(three, byte)), grey_of(hn::And(hn::ShiftRight<8>(three), byte)),
                   grey_of(hn::And(hn::ShiftRight<16>(three), byte)), left, right);
    };
    const VectorF grey =
        blend(across(above), across(here), across(below), weight_of(hn::Sub(half, v)), weight_of(hn::Add(half, v)));
    const VectorF scaled = hn::Mul(hn::Sub(grey, hn::Set(df, static_cast<float>(PatchTemplate::kGreyOrigin))),
                                   hn::Set(df, static_cast<float>(PatchTemplate::kGreyScale)));
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
