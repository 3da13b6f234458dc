// Follows one feature from its predicted pixel to where it is, or says why not.
#pragma once

#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/simd/simd_target.hpp"
#include "core/vision/patch_kernels.hpp"
#include "core/vision/patch_template.hpp"

namespace perimap {

// How the feature looked when it was last found, against its template.
struct PatchState {
  Vector2d px = Vector2d::Zero();
  Matrix2d A = Matrix2d::Identity();  // template pixel offset -> image pixel offset
  double gain = 1;                    // I = gain * T + bias, grey levels
  double bias = 0;
};

struct StretchRange {
  double smallest;
  double largest;
};

// The singular values of A: by how much a shape is compressed and stretched.
[[nodiscard]] StretchRange stretch_of(const Matrix2d& A) noexcept;

enum class MatchState : std::uint8_t {
  kFound,
  kOutOfView,       // the patch is not wholly inside the frame
  kLowCorrelation,  // nothing there looks like the template: occluded, or a highlight on it
  kDiverged,        // alignment did not come to rest, or came to rest in a shape that tissue does not take
  kTooFar,          // found, but further from the prediction than its covariance allows
  kInvalidInput,    // not finite, a covariance that is not positive definite, a singular A, no image
};

struct PatchMatch {
  MatchState state = MatchState::kInvalidInput;
  Vector2d px = Vector2d::Zero();              // where it was found; the prediction when it was not
  Matrix2d covariance_px2 = Matrix2d::Zero();  // of px; meaningful with kFound and kTooFar
  double correlation = 0;                      // zero-mean normalised, [-1, 1], of the aligned patch
};

struct PatchTrackerSettings {
  double min_correlation = 0.88;
  double gate = 13.8;            // chi^2, 2 degrees of freedom, 99.9 %
  double sigma_floor_px = 0.05;  // what interpolation, shading and surface curvature leave on a good match
  double max_stretch = 2.5;      // singular values of A lie in [1/max_stretch, max_stretch]
};

// Aligns the patch, translation first and coarse to fine, then affine, by inverse composition (Baker & Matthews,
// "Lucas-Kanade 20 Years On: A Unifying Framework", IJCV 56(3), 2004) with gain and bias, from the predicted pixel on:
// from level 0, 1 or 2 as the gate is wide. When alignment fails, or ends far from where it began in a wide gate, every
// place in the gate is searched by normalised cross-correlation at the level whose pixels make its radius at most 5 (at
// the coarsest level up to 10, and it is cut there: +-40 px), and the best peaks are aligned.
//
// Reads the windows it looks at and nothing else of the image. A match is judged by its residual, that is by its
// normalised correlation with the template and by the gate, not by tracking it back: the template does not change from
// frame to frame, so nothing drifts that a way back could reveal, and the way back costs as much as the way there.
//
// Any number of threads may share a tracker. Results are the same on every instruction set.
class PatchTracker {
 public:
  explicit PatchTracker(const PatchTrackerSettings& settings = {}, SimdTarget target = best_simd_target())
      : settings_(settings), kernels_(&patch_kernels(target)) {}

  [[nodiscard]] const PatchKernels& kernels() const noexcept { return *kernels_; }

  // prediction_covariance_px2 is the search region and the gate: chi^2 of the found place under the sum of it and the
  // match's own covariance. The match's covariance comes from the residual's variance and the Hessian, plus the floor.
  // state is read for A alone and written with kFound alone.
  [[nodiscard]] PatchMatch track(const GreyImage& image, const PatchTemplate& patch, PatchState& state,
                                 const Vector2d& predicted_px,
                                 const Matrix2d& prediction_covariance_px2) const noexcept;

 private:
  PatchTrackerSettings settings_;
  const PatchKernels* kernels_;
};

// True when the view has changed so much (scale or foreshortening beyond 2) that a fresh template at the found pixel
// would serve better. Each renewal moves the followed point by about the match's standard deviation, and a heart's own
// beat stretches its picture by up to 1.5 and back: renew only what stays stale for longer than a cycle.
[[nodiscard]] bool template_is_stale(const PatchState& state) noexcept;

}  // namespace perimap
