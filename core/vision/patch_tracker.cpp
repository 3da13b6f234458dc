#include "core/vision/patch_tracker.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/vision/patch_alignment.hpp"
#include "core/vision/patch_search.hpp"

namespace perimap {
namespace {

struct StretchRange {
  double smallest;
  double largest;
};

// The singular values of A, in closed form.
StretchRange stretch(const Matrix2d& A) noexcept {
  const double sum = std::hypot(A(0, 0) + A(1, 1), A(1, 0) - A(0, 1));
  const double difference = std::hypot(A(0, 0) - A(1, 1), A(1, 0) + A(0, 1));
  return {0.5 * std::abs(sum - difference), 0.5 * (sum + difference)};
}

// Tissue stretches within bounds and is not seen from behind.
bool is_plausible(const Matrix2d& A, double max_stretch) noexcept {
  const StretchRange range = stretch(A);
  return A.determinant() > 0 && range.smallest * max_stretch >= 1 && range.largest <= max_stretch;
}

double larger_eigenvalue(const Matrix2d& C) noexcept {
  return 0.5 * (C(0, 0) + C(1, 1)) + std::hypot(0.5 * (C(0, 0) - C(1, 1)), 0.5 * (C(0, 1) + C(1, 0)));
}

bool is_positive_definite(const Matrix2d& C) noexcept {
  constexpr double kLargest = 1e12;  // px^2; also keeps the determinant finite
  return C.allFinite() && C(0, 0) > 0 && C(1, 1) > 0 && C(0, 0) < kLargest && C(1, 1) < kLargest && C.determinant() > 0;
}

// Covariance of the aligned position in template pixels, px^2, from the inverse of the Hessian's translation part and
// the residual, of which the template's noise is one half and the image's the other. The template's own noise adds to
// the Hessian H what no motion can be read from: with b its share, the least-squares estimate has covariance
// sigma^2 (H - b)^-1 H (H - b)^-1.
Matrix2d match_covariance(const Matrix2d& inverse_hessian, int pixels, const AlignmentResult& fit) noexcept {
  const double variance = fit.residual_variance / (fit.gain * fit.gain);
  constexpr double kSobelNoise = 12.0 / 64;  // its squared weights, over 8 squared
  const Matrix2d H = inverse_hessian.inverse();
  const double smaller = 0.5 * H.trace() - std::hypot(0.5 * (H(0, 0) - H(1, 1)), H(0, 1));
  // More than half cannot be told from structure that does not fit, which is in the residual too.
  const double b = std::min(pixels * kSobelNoise * 0.5 * variance, 0.5 * smaller);
  const Matrix2d informed = (H - b * Matrix2d::Identity()).inverse();
  return variance * informed * H * informed;
}

// One attempt's outcome in level-0 pixels.
struct Attempt {
  MatchState state = MatchState::kDiverged;
  PatchWarp warp;
  AlignmentResult fit;
  Matrix2d covariance_px2;
};

class Attempts {
 public:
  Attempts(const ImagePyramid& pyramid, const PatchTemplate& patch, const PatchTrackerSettings& settings) noexcept
      : pyramid_(pyramid), patch_(patch), settings_(settings) {}

  // Translation from start_level down to level 0, then affine. start in level-0 pixels.
  [[nodiscard]] Attempt align_from(int start_level, const PatchWarp& start) const noexcept {
    Attempt attempt;
    attempt.warp = start;
    for (int l = start_level; l > 0; --l) {
      const PatchTemplate::Level& level = patch_.levels[static_cast<std::size_t>(l)];
      if (!level.usable) continue;
      const double scale = 1 << l;
      PatchWarp warp{attempt.warp.centre / scale, attempt.warp.A};
      AlignmentLimits limits;
      limits.at_rest = 0.05;
      // A coarse level that fails is passed over: the finer ones decide.
      if (align_translation(pyramid_.level(l), level, limits, warp).outcome == Alignment::kConverged) {
        attempt.warp.centre = warp.centre * scale;
      }
    }
    align_finest(attempt);
    return attempt;
  }

 private:
  void align_finest(Attempt& attempt) const noexcept {
    const GreyImage image = pyramid_.level(0);
    const PatchTemplate::Level& level = patch_.levels[0];
    AlignmentLimits limits;
    if (patch_.affine_usable) limits.at_rest = 0.3;  // affine alignment finishes the work
    attempt.fit = align_translation(image, level, limits, attempt.warp);
    Matrix2d covariance_template = inverse_hessian_translation();
    if (attempt.fit.outcome == Alignment::kConverged && patch_.affine_usable) {
      PatchWarp warp = attempt.warp;
      limits.at_rest = 0.02;
      const AlignmentResult fit = align_affine(image, patch_, limits, warp);
      // Six parameters fit at least as well as two unless they ran away; then the two stand.
      if (fit.outcome == Alignment::kConverged && fit.correlation > attempt.fit.correlation - 0.01 &&
          is_plausible(warp.A, settings_.max_stretch)) {
        attempt.fit = fit;
        attempt.warp = warp;
        covariance_template = inverse_hessian_affine();
      }
    }
    attempt.state = judge(attempt.fit);
    const Matrix2d spread = match_covariance(covariance_template, level.side * level.side, attempt.fit);
    attempt.covariance_px2 = attempt.warp.A * spread * attempt.warp.A.transpose();
    attempt.covariance_px2 += settings_.sigma_floor_px * settings_.sigma_floor_px * Matrix2d::Identity();
  }

  [[nodiscard]] MatchState judge(const AlignmentResult& fit) const noexcept {
    if (fit.outcome == Alignment::kOutOfView) return MatchState::kOutOfView;
    if (!(fit.correlation >= settings_.min_correlation)) return MatchState::kLowCorrelation;
    return fit.outcome == Alignment::kConverged ? MatchState::kFound : MatchState::kDiverged;
  }

  [[nodiscard]] Matrix2d inverse_hessian_translation() const noexcept {
    const auto& inverse = patch_.levels[0].translation_inverse;
    Matrix2d C;
    C << inverse[0], inverse[1], inverse[2], inverse[3];
    return C;
  }
  [[nodiscard]] Matrix2d inverse_hessian_affine() const noexcept {
    const auto& inverse = patch_.affine_inverse;
    Matrix2d C;
    C << inverse[0], inverse[1], inverse[PatchTemplate::kParameters], inverse[PatchTemplate::kParameters + 1];
    return C;
  }

  const ImagePyramid& pyramid_;
  const PatchTemplate& patch_;
  const PatchTrackerSettings& settings_;
};

// The finest level that covers the gate in few enough positions, else the coarsest.
constexpr int kQuickSearchRadius = 5;  // level pixels

int search_level(const ImagePyramid& pyramid, const PatchTemplate& patch, double radius_px) noexcept {
  int chosen = 0;
  for (int l = 0; l < pyramid.levels(); ++l) {
    if (!patch.levels[static_cast<std::size_t>(l)].usable) continue;
    chosen = l;
    if (radius_px <= kQuickSearchRadius * (1 << l)) break;
  }
  return chosen;
}

}  // namespace

PatchMatch track(const ImagePyramid& pyramid, const PatchTemplate& patch, PatchState& state,
                 const Vector2d& predicted_px, const Matrix2d& prediction_covariance_px2,
                 const PatchTrackerSettings& settings) noexcept {
  PatchMatch match;
  match.px = predicted_px;
  if (!predicted_px.allFinite() || !is_positive_definite(prediction_covariance_px2) || !state.A.allFinite() ||
      !is_plausible(state.A, 2 * settings.max_stretch) || !patch.levels[0].usable || pyramid.level(0).data == nullptr) {
    return match;
  }

  const Attempts attempts(pyramid, patch, settings);
  const double radius_px = std::sqrt(settings.gate * larger_eigenvalue(prediction_covariance_px2));
  // What alignment alone reaches from its start at levels 0 and 1, measured on smooth texture.
  constexpr double kReachOfLevel0_px = 2.5;
  constexpr double kReachOfLevel1_px = 6;
  Attempt best;
  if (radius_px <= kReachOfLevel1_px) {
    best = attempts.align_from(radius_px <= kReachOfLevel0_px ? 0 : 1, {predicted_px, state.A});
  }
  if (best.state != MatchState::kFound) {
    const int l = search_level(pyramid, patch, radius_px);
    const double scale = 1 << l;
    // At least one pixel of the level to either side, so that a peak can be told.
    Matrix2d covariance = prediction_covariance_px2 / (scale * scale) + Matrix2d::Identity() / settings.gate;
    covariance(0, 1) = covariance(1, 0) = 0.5 * (covariance(0, 1) + covariance(1, 0));
    constexpr double kWorthAligning = 0.4;  // correlation on whole pixels before alignment
    const SearchResult found = search_peaks(pyramid.level(l), patch.levels[static_cast<std::size_t>(l)], state.A,
                                            predicted_px / scale, covariance.inverse(), settings.gate, kWorthAligning);
    MatchState why = found.any_in_view ? MatchState::kLowCorrelation : MatchState::kOutOfView;
    for (int i = 0; i < found.count; ++i) {
      const PatchWarp start{found.peaks[static_cast<std::size_t>(i)].centre * scale, state.A};
      const Attempt attempt = attempts.align_from(l, start);
      if (attempt.state != MatchState::kFound) {
        if (i == 0) why = attempt.state;
        continue;
      }
      if (best.state != MatchState::kFound || attempt.fit.correlation > best.fit.correlation) best = attempt;
      constexpr double kBeyondDoubt = 0.95;
      if (best.fit.correlation > kBeyondDoubt) break;
    }
    if (best.state != MatchState::kFound) {
      match.state = why;
      match.correlation = best.fit.correlation;
      return match;
    }
  }

  match.px = best.warp.centre;
  match.correlation = best.fit.correlation;
  match.covariance_px2 = best.covariance_px2;
  const Vector2d e = match.px - predicted_px;
  const Matrix2d S = prediction_covariance_px2 + match.covariance_px2;
  if (!(e.dot(S.inverse() * e) <= settings.gate)) {
    match.state = MatchState::kTooFar;
    return match;
  }
  match.state = MatchState::kFound;
  state = {best.warp.centre, best.warp.A, best.fit.gain, best.fit.bias};
  return match;
}

bool template_is_stale(const PatchState& state) noexcept {
  constexpr double kWorn = 2.0;
  const StretchRange range = stretch(state.A);
  return !(range.largest < kWorn && range.smallest > 1 / kWorn);
}

}  // namespace perimap
