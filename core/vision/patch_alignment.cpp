#include "core/vision/patch_alignment.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace perimap {
namespace {

constexpr int kParameters = PatchTemplate::kParameters;
using Vector6 = Eigen::Matrix<double, kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, kParameters, kParameters>;

// The image at the warped window. The window must fit.
void sample_window(const GreyImage& image, const PatchTemplate::Level& level, const PatchWarp& warp,
                   const PatchKernels& kernels, PatchSamples& samples) noexcept {
  const Vector2d to_first(-level.half() - level.offset_x, -level.half() - level.offset_y);
  if (warp.A.isIdentity(0)) {
    kernels.sample_shifted(image, level.side, warp.centre + to_first, samples);
  } else {
    kernels.sample_warped(image, level.side, {warp.centre + warp.A * to_first, warp.A.col(0), warp.A.col(1)}, samples);
  }
}

struct Sums {
  double grey = 0, grey_squared = 0, with_template = 0;  // of I, I^2, T I, I less kGreyOrigin
  Vector6 with_sd = Vector6::Zero();                     // of SD_k I; the last four only when asked for
};

Sums in_grey_levels(const PatchTemplate::Level& level, const PatchSums& raw) noexcept {
  constexpr double kGrey = 1.0 / PatchTemplate::kGreyScale;
  constexpr double kGradient = kGrey / PatchTemplate::kGradientScale;
  constexpr double kMoment = kGradient * PatchTemplate::kMomentDivisor;
  Sums sums;
  sums.grey = kGrey * raw.grey;
  sums.grey_squared = kGrey * kGrey * raw.grey_squared;
  sums.with_template = kGrey * kGrey * raw.with_template;
  const double gx = kGradient * raw.with_gradient_x, gy = kGradient * raw.with_gradient_y;
  sums.with_sd << gx, gy, kMoment * raw.with_moments[0] - level.offset_x * gx,
      kMoment * raw.with_moments[1] - level.offset_y * gx, kMoment * raw.with_moments[2] - level.offset_x * gy,
      kMoment * raw.with_moments[3] - level.offset_y * gy;
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

// See AlignmentResult::residual_variance; of level 0. free_parameters are those of the warp.
double residual_variance(const PatchTemplate::Level& level, const PatchSamples& samples, const AlignmentResult& fit,
                         int free_parameters) noexcept {
  constexpr int kBlock = 3;
  constexpr int kSide = PatchTemplate::kSide[0];
  constexpr int kAcross = kSide / kBlock;
  // Of a block: its samples' sum less the gain times its template pixels' and less scaled_bias.
  constexpr int kGreyScale = PatchTemplate::kGreyScale;
  const double scaled_bias = kGreyScale * kBlock * kBlock * (fit.bias + (fit.gain - 1) * PatchTemplate::kGreyOrigin);
  double sum_squares = 0;
  for (int by = 0; by < kAcross; ++by) {
    std::array<int, kSide> seen{};  // sums over the block's rows
    std::array<int, kSide> expected{};
    const std::int16_t* const grey = samples.grey.data() + kBlock * by * kSide;
    const std::int16_t* const value = level.value.data() + kBlock * by * kSide;
    for (int x = 0; x < kSide; ++x) {
      seen[static_cast<std::size_t>(x)] = grey[x] + grey[x + kSide] + grey[x + 2 * kSide];
      expected[static_cast<std::size_t>(x)] = value[x] + value[x + kSide] + value[x + 2 * kSide];
    }
    for (int bx = 0; bx < kAcross; ++bx) {
      const auto x = static_cast<std::size_t>(kBlock * bx);
      const double residual = (seen[x] + seen[x + 1] + seen[x + 2]) -
                              fit.gain * (expected[x] + expected[x + 1] + expected[x + 2]) - scaled_bias;
      sum_squares += residual * residual;
    }
  }
  // Gain, bias and warp have taken their share of the low frequencies.
  const double free_blocks = kAcross * kAcross - 2 - free_parameters;
  // What a block of smoothed pixels keeps of its pixels' noise, sampled at whole pixels; 0.69 half-way between.
  constexpr double kKept = 0.73;
  return sum_squares / (kKept * kGreyScale * kGreyScale * kBlock * kBlock * free_blocks);
}

// The projected steepest-descent images times the image, divided by the gain: the right-hand side of the normal
// equations (Baker & Matthews 2004, section 3.2, with the projection of Part 3), but for the gain.
//
// With the gain of least squares it is the projection's own. A template that is as noisy as the image would then move
// against its own slope, each time by the same: its noise makes that gain too small. The ratio of the deviations is not
// made smaller, as both are noisy alike; where the two fit it is the same.
Vector6 right_hand_side(const PatchTemplate::Level& level, const Sums& sums, double gain) noexcept {
  return (sums.with_sd - Vector6::Map(level.sd_mean.data()) * sums.grey -
          Vector6::Map(level.sd_on_grey.data()) * (gain * level.sum_squares)) /
         gain;
}

constexpr double kMinGain = 0.1;
constexpr double kMaxStep = 2.0;  // level pixels: beyond it the linearisation means nothing

struct TranslationStep {
  static constexpr int kFree = 2;
  const PatchTemplate::Level& level;

  void sum(const PatchKernels& kernels, const PatchSamples& samples, PatchSums& sums) const noexcept {
    kernels.sum(level, samples, sums);
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

  void sum(const PatchKernels& kernels, const PatchSamples& samples, PatchSums& sums) const noexcept {
    kernels.sum_affine(patch, samples, sums);
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
                        const AlignmentLimits& limits, const PatchKernels& kernels, PatchWarp& warp) noexcept {
  PatchSamples samples;  // NOLINT(cppcoreguidelines-pro-type-member-init): sample_window() fills it, each iteration
  const Vector2d start = warp.centre;
  AlignmentResult result;
  bool at_rest = false;
  for (int iteration = 0; iteration < limits.max_iterations && !at_rest; ++iteration) {
    if (!warped_window_fits(image, level, warp)) {
      result.outcome = Alignment::kOutOfView;
      return result;
    }
    sample_window(image, level, warp, kernels, samples);
    PatchSums raw;
    step.sum(kernels, samples, raw);
    const Sums sums = in_grey_levels(level, raw);
    result = compare(level, sums);
    if (!(result.gain > kMinGain)) return result;
    const double gain = limits.gain_is_ratio ? result.gain / result.correlation : result.gain;
    const double moved = step.apply(right_hand_side(level, sums, gain), warp);
    if (!((warp.centre - start).norm() <= limits.max_travel)) return result;
    // Still creeping at the last step: near enough for the next stage, which has its own test.
    constexpr double kNearlyAtRest = 10;
    const bool is_last = iteration + 1 == limits.max_iterations;
    at_rest = moved < (is_last ? kNearlyAtRest : 1) * limits.at_rest;
  }
  if (!at_rest) return result;
  result.outcome = Alignment::kConverged;
  if (limits.wants_residual && level.side == PatchTemplate::kSide[0]) {
    result.residual_variance = residual_variance(level, samples, result, Step::kFree);
  }
  return result;
}

}  // namespace

bool warped_window_fits(const GreyImage& image, const PatchTemplate::Level& level, const PatchWarp& warp) noexcept {
  const double reach_u = std::abs(warp.A(0, 0)) + std::abs(warp.A(0, 1));
  const double reach_v = std::abs(warp.A(1, 0)) + std::abs(warp.A(1, 1));
  const double half = level.half() + 0.01;  // the kernels' positions round
  const double u = warp.centre.x() - warp.A(0, 0) * level.offset_x - warp.A(0, 1) * level.offset_y;
  const double v = warp.centre.y() - warp.A(1, 0) * level.offset_x - warp.A(1, 1) * level.offset_y;
  constexpr double kMaxReach = 8;                 // so that offsets within the window fit 32 bits,
  constexpr std::ptrdiff_t kMaxStride = 1 << 22;  // with this
  if (image.stride > kMaxStride) return false;
  constexpr int kBefore = PatchKernels::kBefore, kBehind = PatchKernels::kBehind;
  return reach_u < kMaxReach && reach_v < kMaxReach && u - half * reach_u >= kBefore && v - half * reach_v >= kBefore &&
         u + half * reach_u < image.width - kBehind && v + half * reach_v < image.height - kBehind;
}

AlignmentResult align_translation(const GreyImage& image, const PatchTemplate::Level& level,
                                  const AlignmentLimits& limits, const PatchKernels& kernels,
                                  PatchWarp& warp) noexcept {
  return iterate(image, level, TranslationStep{level}, limits, kernels, warp);
}

AlignmentResult align_affine(const GreyImage& image, const PatchTemplate& patch, const AlignmentLimits& limits,
                             const PatchKernels& kernels, PatchWarp& warp) noexcept {
  return iterate(image, patch.levels[0], AffineStep{patch}, limits, kernels, warp);
}

}  // namespace perimap
