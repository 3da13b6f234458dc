#include "core/vision/patch_alignment.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace perimap {
namespace {

constexpr int kParameters = PatchTemplate::kParameters;
constexpr int kLanes = 8;  // independent partial sums, a fixed order that the compiler may still vectorise
using Vector6 = Eigen::Matrix<double, kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, kParameters, kParameters>;
using Samples = std::array<float, PatchTemplate::kMaxSamples>;

// Positions inside a window are followed in 1/65536 px, which is exact and quicker than floor() for each pixel.
constexpr int kFractionBits = 16;
constexpr float kFraction = 1.0F / (1 << kFractionBits);
constexpr int to_fixed(double x) noexcept { return static_cast<int>(std::floor(x * (1 << kFractionBits) + 0.5)); }

// The image at the warped window, bilinear, less kGreyOrigin; the padding of each row stays 0. The window must fit.
void sample_window(const GreyImage& image, const PatchTemplate::Level& level, const PatchWarp& warp,
                   Samples& out) noexcept {
  const int base_u = static_cast<int>(std::floor(warp.centre.x()));
  const int base_v = static_cast<int>(std::floor(warp.centre.y()));
  const double first = -level.half();
  const Vector2d start =
      warp.centre - Vector2d(base_u, base_v) + warp.A * Vector2d(first - level.offset_x, first - level.offset_y);
  const std::ptrdiff_t stride = image.stride;
  const std::uint8_t* const base = image.row(base_v) + base_u;

  if (warp.A.isIdentity(0)) {
    const int u0 = to_fixed(start.x()), v0 = to_fixed(start.y());
    const float fu = static_cast<float>(u0 & ((1 << kFractionBits) - 1)) * kFraction;
    const float fv = static_cast<float>(v0 & ((1 << kFractionBits) - 1)) * kFraction;
    const float w00 = (1 - fu) * (1 - fv), w01 = fu * (1 - fv), w10 = (1 - fu) * fv, w11 = fu * fv;
    for (int y = 0; y < level.side; ++y) {
      const std::uint8_t* p = base + ((v0 >> kFractionBits) + y) * stride + (u0 >> kFractionBits);
      const std::uint8_t* q = p + stride;
      float* row = out.data() + y * level.stride;
      for (int x = 0; x < level.side; ++x) {
        row[x] = w00 * p[x] + w01 * p[x + 1] + w10 * q[x] + w11 * q[x + 1] - PatchTemplate::kGreyOrigin;
      }
    }
    return;
  }

  const int du_dx = to_fixed(warp.A(0, 0)), dv_dx = to_fixed(warp.A(1, 0));
  for (int y = 0; y < level.side; ++y) {
    int u = to_fixed(start.x() + warp.A(0, 1) * y), v = to_fixed(start.y() + warp.A(1, 1) * y);
    float* row = out.data() + y * level.stride;
    for (int x = 0; x < level.side; ++x, u += du_dx, v += dv_dx) {
      const std::uint8_t* p = base + (v >> kFractionBits) * stride + (u >> kFractionBits);
      const float fu = static_cast<float>(u & ((1 << kFractionBits) - 1)) * kFraction;
      const float fv = static_cast<float>(v & ((1 << kFractionBits) - 1)) * kFraction;
      const float p0 = p[0], q0 = p[stride];
      const float top = p0 + fu * (static_cast<float>(p[1]) - p0);
      const float bottom = q0 + fu * (static_cast<float>(p[stride + 1]) - q0);
      row[x] = top + fv * (bottom - top) - PatchTemplate::kGreyOrigin;
    }
  }
}

struct Sums {
  double grey = 0, grey_squared = 0, with_template = 0;  // of I, I^2, T I
  Vector6 with_sd = Vector6::Zero();                     // of SD_k I; the last four only when asked for
};

double total(const std::array<float, kLanes>& lanes) noexcept {
  return ((static_cast<double>(lanes[0]) + lanes[1]) + (static_cast<double>(lanes[2]) + lanes[3])) +
         ((static_cast<double>(lanes[4]) + lanes[5]) + (static_cast<double>(lanes[6]) + lanes[7]));
}

template <bool kAffine>
Sums accumulate(const PatchTemplate::Level& level, const Samples& samples) noexcept {
  std::array<float, kLanes> s_i{}, s_ii{}, s_ti{}, s_gx{}, s_gy{}, s_gx_x{}, s_gx_y{}, s_gy_x{}, s_gy_y{};
  for (int y = 0; y < level.side; ++y) {
    const float dy = static_cast<float>(y - level.half());
    for (int block = 0; block < level.stride; block += kLanes) {
      const std::size_t start = static_cast<std::size_t>(y * level.stride + block);
      const float* const grey = samples.data() + start;
      const std::int16_t* const value = level.value.data() + start;
      const std::int16_t* const gradient_x = level.gradient_x.data() + start;
      const std::int16_t* const gradient_y = level.gradient_y.data() + start;
      for (int k = 0; k < kLanes; ++k) {
        const std::size_t lane = static_cast<std::size_t>(k);
        const float i = grey[k];
        const float gx = gradient_x[k] * i, gy = gradient_y[k] * i;
        s_i[lane] += i;
        s_ii[lane] += i * i;
        s_ti[lane] += value[k] * i;
        s_gx[lane] += gx;
        s_gy[lane] += gy;
        if constexpr (kAffine) {
          const float dx = static_cast<float>(block + k - level.half());
          s_gx_x[lane] += gx * dx;
          s_gx_y[lane] += gx * dy;
          s_gy_x[lane] += gy * dx;
          s_gy_y[lane] += gy * dy;
        }
      }
    }
  }
  Sums sums;
  sums.grey = total(s_i);
  sums.grey_squared = total(s_ii);
  sums.with_template = total(s_ti);
  constexpr double kUnit = 1 / PatchTemplate::kGradientScale;
  const double gx = kUnit * total(s_gx), gy = kUnit * total(s_gy);
  sums.with_sd[0] = gx;
  sums.with_sd[1] = gy;
  if constexpr (kAffine) {
    sums.with_sd[2] = kUnit * total(s_gx_x) - level.offset_x * gx;
    sums.with_sd[3] = kUnit * total(s_gx_y) - level.offset_y * gx;
    sums.with_sd[4] = kUnit * total(s_gy_x) - level.offset_x * gy;
    sums.with_sd[5] = kUnit * total(s_gy_y) - level.offset_y * gy;
  }
  return sums;
}

// How well the sampled window fits the template, gain and bias solved for.
AlignmentResult compare(const PatchTemplate::Level& level, const Sums& sums) noexcept {
  const double n = level.side * level.side;
  const double mean = sums.grey / n;
  const double variance_sum = sums.grey_squared - sums.grey * mean;
  const double covariance_sum = sums.with_template - level.mean * sums.grey;
  AlignmentResult result;
  result.gain = covariance_sum / level.sum_squares;
  result.bias = mean + PatchTemplate::kGreyOrigin - result.gain * (level.mean + PatchTemplate::kGreyOrigin);
  if (variance_sum > 0) result.correlation = covariance_sum / std::sqrt(variance_sum * level.sum_squares);
  return result;
}

// See AlignmentResult::residual_variance. free_parameters are those of the warp.
double residual_variance(const PatchTemplate::Level& level, const Samples& samples, const AlignmentResult& fit,
                         int free_parameters) noexcept {
  constexpr int kBlock = 3;
  const int across = level.side / kBlock;
  const float gain = static_cast<float>(fit.gain);
  const float bias = static_cast<float>(fit.bias + (fit.gain - 1) * PatchTemplate::kGreyOrigin);
  double sum_squares = 0;
  for (int by = 0; by < across; ++by) {
    std::array<float, PatchTemplate::kMaxStride> column{};  // sums over the block's rows
    for (int y = kBlock * by; y < kBlock * (by + 1); ++y) {
      const float* const grey = samples.data() + y * level.stride;
      const std::int16_t* const value = level.value.data() + y * level.stride;
      for (int x = 0; x < level.stride; ++x) column[static_cast<std::size_t>(x)] += grey[x] - gain * value[x] - bias;
    }
    for (int bx = 0; bx < across; ++bx) {
      const std::size_t x = static_cast<std::size_t>(kBlock * bx);
      const double sum = static_cast<double>(column[x]) + column[x + 1] + column[x + 2];
      sum_squares += sum * sum;
    }
  }
  // Gain, bias and warp have taken their share of the low frequencies.
  const double free_blocks = across * across - 2 - free_parameters;
  return sum_squares / (kBlock * kBlock * free_blocks);
}

// The projected steepest-descent images times the image, divided by the gain: the right-hand side of the normal
// equations (Baker & Matthews 2004, section 3.2, with the projection of Part 3).
Vector6 right_hand_side(const PatchTemplate::Level& level, const Sums& sums, double gain) noexcept {
  const double covariance_sum = sums.with_template - level.mean * sums.grey;
  return (sums.with_sd - Vector6::Map(level.sd_mean.data()) * sums.grey -
          Vector6::Map(level.sd_on_grey.data()) * covariance_sum) /
         gain;
}

constexpr double kMinGain = 0.1;
constexpr double kMaxStep = 2.0;  // level pixels: beyond it the linearisation means nothing

struct TranslationStep {
  static constexpr int kFree = 2;
  const PatchTemplate::Level& level;

  static Sums sums(const PatchTemplate::Level& level, const Samples& samples) noexcept {
    return accumulate<false>(level, samples);
  }
  // Returns the largest displacement in the window, level pixels.
  double apply(const Vector6& b, PatchWarp& warp) const noexcept {
    const auto& inverse = level.translation_inverse;
    Vector2d t(inverse[0] * b[0] + inverse[1] * b[1], inverse[2] * b[0] + inverse[3] * b[1]);
    const double length = t.norm();
    if (length > kMaxStep) t *= kMaxStep / length;
    warp.centre -= warp.A * t;
    return length;
  }
};

struct AffineStep {
  static constexpr int kFree = kParameters;
  const PatchTemplate& patch;

  static Sums sums(const PatchTemplate::Level& level, const Samples& samples) noexcept {
    return accumulate<true>(level, samples);
  }
  double apply(const Vector6& b, PatchWarp& warp) const noexcept {
    Vector6 step = Matrix6::Map(patch.affine_inverse.data()) * b;
    const double half = patch.levels[0].half();
    const double length = step.head<2>().norm() + half * step.tail<4>().cwiseAbs().maxCoeff();
    if (length > kMaxStep) step *= kMaxStep / length;
    Matrix2d increment;
    increment << 1 + step[2], step[3], step[4], 1 + step[5];
    // Composition with the inverse of the increment: A' = A (I + M)^-1, centre' = centre - A' t.
    warp.A = warp.A * increment.inverse();
    warp.centre -= warp.A * step.head<2>();
    return length;
  }
};

template <class Step>
AlignmentResult iterate(const GreyImage& image, const PatchTemplate::Level& level, const Step& step,
                        const AlignmentLimits& limits, PatchWarp& warp) noexcept {
  Samples samples;
  std::fill_n(samples.begin(), level.side * level.stride, 0.0F);
  const Vector2d start = warp.centre;
  AlignmentResult result;
  bool at_rest = false;
  for (int iteration = 0; iteration < limits.max_iterations && !at_rest; ++iteration) {
    if (!warped_window_fits(image, level, warp)) {
      result.outcome = Alignment::kOutOfView;
      return result;
    }
    sample_window(image, level, warp, samples);
    const Sums sums = Step::sums(level, samples);
    result = compare(level, sums);
    if (!(result.gain > kMinGain)) return result;
    const double moved = step.apply(right_hand_side(level, sums, result.gain), warp);
    if (!((warp.centre - start).norm() <= limits.max_travel)) return result;
    // Still creeping at the last step: near enough for the next stage, which has its own test.
    constexpr double kNearlyAtRest = 10;
    const bool is_last = iteration + 1 == limits.max_iterations;
    at_rest = moved < (is_last ? kNearlyAtRest : 1) * limits.at_rest;
  }
  if (!at_rest) return result;
  result.outcome = Alignment::kConverged;
  result.residual_variance = residual_variance(level, samples, result, Step::kFree);
  return result;
}

}  // namespace

bool warped_window_fits(const GreyImage& image, const PatchTemplate::Level& level, const PatchWarp& warp) noexcept {
  // Of a window this wide every position is then within the fixed-point range of sample_window as well.
  const double reach_u = std::abs(warp.A(0, 0)) + std::abs(warp.A(0, 1));
  const double reach_v = std::abs(warp.A(1, 0)) + std::abs(warp.A(1, 1));
  const double half = level.half() + 0.01;  // the fixed-point positions round
  const double u = warp.centre.x() - warp.A(0, 0) * level.offset_x - warp.A(0, 1) * level.offset_y;
  const double v = warp.centre.y() - warp.A(1, 0) * level.offset_x - warp.A(1, 1) * level.offset_y;
  constexpr double kMaxReach = 8;
  return reach_u < kMaxReach && reach_v < kMaxReach && u - half * reach_u >= 0 && v - half * reach_v >= 0 &&
         u + half * reach_u < image.width - 1 && v + half * reach_v < image.height - 1;
}

AlignmentResult align_translation(const GreyImage& image, const PatchTemplate::Level& level,
                                  const AlignmentLimits& limits, PatchWarp& warp) noexcept {
  return iterate(image, level, TranslationStep{level}, limits, warp);
}

AlignmentResult align_affine(const GreyImage& image, const PatchTemplate& patch, const AlignmentLimits& limits,
                             PatchWarp& warp) noexcept {
  return iterate(image, patch.levels[0], AffineStep{patch}, limits, warp);
}

}  // namespace perimap
