#include "core/vision/patch_tracker.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/vision/patch_alignment.hpp"
#include "core/vision/patch_search.hpp"
#include "core/vision/reduced_window.hpp"

namespace perimap {
namespace {

// Tissue stretches within bounds and is not seen from behind.
bool is_plausible(const Matrix2d& A, double max_stretch) noexcept {
  const StretchRange range = stretch_of(A);
  return A.determinant() > 0 && range.smallest * max_stretch >= 1 && range.largest <= max_stretch;
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
  // More than half cannot be told from structure that does not fit, which is in the residual too.
  const double b = std::min(pixels * kSobelNoise * 0.5 * variance, 0.5 * smaller_eigenvalue(H));
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
  Attempts(const GreyImage& image, const PatchTemplate& patch, const PatchTrackerSettings& settings,
           const PatchKernels& kernels) noexcept
      : image_(image), patch_(patch), settings_(settings), kernels_(kernels) {}

  // Translation from start_level down to level 0, then affine. start in level-0 pixels.
  [[nodiscard]] Attempt align_from(int start_level, const PatchWarp& start) const noexcept {
    Attempt attempt;
    attempt.warp = start;
    for (int l = start_level; l > 0; --l) align_coarse(l, attempt.warp);
    align_finest(attempt);
    return attempt;
  }

 private:
  [[nodiscard]] AlignmentLimits usual_limits() const noexcept {
    AlignmentLimits limits;
    limits.gain_is_ratio = patch_.is_of_frame_before;
    return limits;
  }

  // A coarse level that fails is passed over: the finer ones decide.
  void align_coarse(int l, PatchWarp& warp) const noexcept {
    const PatchTemplate::Level& level = patch_.levels[static_cast<std::size_t>(l)];
    if (!level.usable) return;
    AlignmentLimits limits = usual_limits();
    limits.at_rest = 0.1;
    const Vector2d centre = to_level(warp.centre, l);
    const double reach = (level.half() + 1) * warp.A.cwiseAbs().rowwise().sum().maxCoeff() + limits.max_travel + 3;
    const ReducedWindow window(image_, l, centre, reach, kernels_);
    PatchWarp inside{centre - window.origin(), warp.A};
    if (align_translation(window.image(), level, limits, kernels_, inside).outcome != Alignment::kConverged) return;
    warp.centre = from_level(inside.centre + window.origin(), l);
  }

  void align_finest(Attempt& attempt) const noexcept {
    const PatchTemplate::Level& level = patch_.levels[0];
    AlignmentLimits limits = usual_limits();
    limits.wants_residual = true;
    if (patch_.affine_usable && approach(attempt)) {
      PatchWarp warp = attempt.warp;
      limits.at_rest = 0.05;
      attempt.fit = align_affine(image_, patch_, limits, kernels_, warp);
      if (attempt.fit.outcome == Alignment::kConverged && is_plausible(warp.A, settings_.max_stretch)) {
        attempt.warp = warp;
        conclude(inverse_hessian_affine(), attempt);
        if (attempt.state == MatchState::kFound) return;
      }
    }
    // Six parameters ran away, or the template does not determine them: two.
    limits.at_rest = 0.01;
    attempt.fit = align_translation(image_, level, limits, kernels_, attempt.warp);
    conclude(inverse_hessian_translation(), attempt);
  }

  // Translation to within what affine alignment finishes. While the shape is near the template's own, the image's own
  // grid will do, which is several times quicker than a warped one.
  [[nodiscard]] bool approach(Attempt& attempt) const noexcept {
    AlignmentLimits limits = usual_limits();
    limits.at_rest = 0.3;
    constexpr double kNear = 0.06;  // moves the window's rim by about half a pixel
    const Matrix2d shape = attempt.warp.A;
    const bool is_near = (shape - Matrix2d::Identity()).cwiseAbs().maxCoeff() < kNear;
    PatchWarp warp = attempt.warp;
    if (is_near) warp.A.setIdentity();
    attempt.fit = align_translation(image_, patch_.levels[0], limits, kernels_, warp);
    if (attempt.fit.outcome != Alignment::kConverged) return false;
    attempt.warp.centre = warp.centre;
    return true;
  }

  void conclude(const Matrix2d& inverse_hessian, Attempt& attempt) const noexcept {
    attempt.state = judge(attempt.fit);
    if (attempt.state != MatchState::kFound) return;
    const int pixels = patch_.levels[0].side * patch_.levels[0].side;
    const Matrix2d spread = match_covariance(inverse_hessian, pixels, attempt.fit);
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

  const GreyImage& image_;
  const PatchTemplate& patch_;
  const PatchTrackerSettings& settings_;
  const PatchKernels& kernels_;
};

// What alignment alone mostly reaches from its start at levels 0 and 1. When it does not, the next level is tried.
constexpr double kReachOfLevel0_px = 4;
constexpr double kReachOfLevel1_px = 8;

// The finest usable level that covers the gate in few enough positions, else the coarsest usable one.
int search_level(const PatchTemplate& patch, double radius_px) noexcept {
  constexpr int kQuickSearchRadius = 5;  // level pixels
  int chosen = 0;
  for (int l = 0; l < PatchTemplate::kLevels; ++l) {
    if (!patch.levels[static_cast<std::size_t>(l)].usable) continue;
    chosen = l;
    if (radius_px <= kQuickSearchRadius * (1 << l)) break;
  }
  return chosen;
}

// The image in which level l is searched, and where its first pixel lies.
SearchResult search(const GreyImage& image, const PatchTemplate& patch, int l, const Matrix2d& A,
                    const Vector2d& predicted_px, const Matrix2d& covariance_px2, double gate,
                    const PatchKernels& kernels) noexcept {
  constexpr double kWorthAligning = 0.4;  // correlation on whole pixels before alignment
  const PatchTemplate::Level& level = patch.levels[static_cast<std::size_t>(l)];
  const double scale = 1 << l;
  // At least one pixel of the level to either side, so that a peak can be told.
  Matrix2d covariance = covariance_px2 / (scale * scale) + Matrix2d::Identity() / gate;
  covariance(0, 1) = covariance(1, 0) = 0.5 * (covariance(0, 1) + covariance(1, 0));
  const Matrix2d information = covariance.inverse();
  if (l == 0) return search_peaks(image, level, A, predicted_px, information, gate, kWorthAligning, kernels);
  const Vector2d predicted = to_level(predicted_px, l);
  const ReducedWindow window(image, l, predicted, level.half() + kMaxSearchRadius + 2, kernels);
  SearchResult result =
      search_peaks(window.image(), level, A, predicted - window.origin(), information, gate, kWorthAligning, kernels);
  for (int i = 0; i < result.count; ++i) {
    Vector2d& centre = result.peaks[static_cast<std::size_t>(i)].centre;
    centre = from_level(centre + window.origin(), l);
  }
  return result;
}

}  // namespace

PatchMatch PatchTracker::track(const GreyImage& image, const PatchTemplate& patch, PatchState& state,
                               const Vector2d& predicted_px, const Matrix2d& prediction_covariance_px2) const noexcept {
  PatchMatch match;
  match.px = predicted_px;
  if (!predicted_px.allFinite() || !is_positive_definite(prediction_covariance_px2) || !state.A.allFinite() ||
      !is_plausible(state.A, 2 * settings_.max_stretch) || !patch.levels[0].usable || image.data == nullptr) {
    return match;
  }

  const Attempts attempts(image, patch, settings_, *kernels_);
  const double radius_px = std::sqrt(settings_.gate * larger_eigenvalue(prediction_covariance_px2));
  const int start_level = radius_px <= kReachOfLevel0_px ? 0 : radius_px <= kReachOfLevel1_px ? 1 : 2;
  constexpr double kBeyondDoubt = 0.95;
  Attempt best = attempts.align_from(start_level, {predicted_px, state.A});
  if (start_level == 0 && best.state != MatchState::kFound && best.state != MatchState::kOutOfView) {
    best = attempts.align_from(1, {predicted_px, state.A});
  }
  const bool is_settled =
      best.state == MatchState::kFound &&
      (start_level < 2 || (best.fit.correlation > kBeyondDoubt &&
                           (best.warp.centre - predicted_px).norm() < std::max(0.4 * radius_px, kReachOfLevel1_px)));
  if (!is_settled) {
    const int l = search_level(patch, radius_px);
    const SearchResult found =
        search(image, patch, l, state.A, predicted_px, prediction_covariance_px2, settings_.gate, *kernels_);
    MatchState why = found.any_in_view ? MatchState::kLowCorrelation : MatchState::kOutOfView;
    for (int i = 0; i < found.count; ++i) {
      const PatchWarp start{found.peaks[static_cast<std::size_t>(i)].centre, state.A};
      const Attempt attempt = attempts.align_from(l, start);
      if (attempt.state != MatchState::kFound) {
        if (i == 0) why = attempt.state;
        continue;
      }
      if (best.state != MatchState::kFound || attempt.fit.correlation > best.fit.correlation) best = attempt;
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
  if (!(e.dot(S.inverse() * e) <= settings_.gate)) {
    match.state = MatchState::kTooFar;
    return match;
  }
  match.state = MatchState::kFound;
  state = {best.warp.centre, best.warp.A, best.fit.gain, best.fit.bias};
  return match;
}

StretchRange stretch_of(const Matrix2d& A) noexcept {
  const double sum = std::hypot(A(0, 0) + A(1, 1), A(1, 0) - A(0, 1));
  const double difference = std::hypot(A(0, 0) - A(1, 1), A(1, 0) + A(0, 1));
  return {0.5 * std::abs(sum - difference), 0.5 * (sum + difference)};
}

bool template_is_stale(const PatchState& state) noexcept {
  constexpr double kWorn = 2.0;
  const StretchRange range = stretch_of(state.A);
  return !(range.largest < kWorn && range.smallest > 1 / kWorn);
}

}  // namespace perimap
