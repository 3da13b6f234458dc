// What a feature looked like when it was seen last: what finds it where its first view no longer does.
#pragma once

#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// The first view does not drift, and costs nothing to keep; where it fits, no other is asked. Wet tissue in vivo
// changes its looks within a second, so that it often does not. Then the feature is followed from the frame before,
// with a way back, and what that adds to the doubt about its place is summed up until the first view fits again. The
// view is made only then, of the frame before, which is still there.
class LastView {
 public:
  // Beside matches of the first view, which are asked for 0.88: weak texture correlates badly with itself from one
  // frame to the next, by its noise. The way back judges.
  static constexpr double kLeastCorrelation = 0.5;
  // Of what was not there in the frame before, for which there is no way back.
  static constexpr double kLeastCorrelationOfReturn = 0.97;
  [[nodiscard]] static PatchTracker tracker() { return PatchTracker({.min_correlation = kLeastCorrelation}); }

  // Of a new feature: there is none yet.
  void forget() noexcept {
    is_there_ = false;
    began_px2_ = drift_px2_ = 0;
  }

  // Of the frame with this number, in which the feature was found at px. Nothing is done where it is of that frame.
  void make(const GreyImage& image, std::uint64_t frame, const Vector2d& px, const PatchKernels& kernels) noexcept;
  [[nodiscard]] bool is_of(std::uint64_t frame) const noexcept { return is_there_ && frame_ == frame; }

  // In the frame after that of the view, with a way back into it; px is where the feature was found there. The match's
  // covariance is that of the followed point: with that of the first view's last match, from which it is followed, and
  // what it has drifted by since.
  [[nodiscard]] PatchMatch follow(const PatchTracker& tracker, const GreyImage& image, const GreyImage& before,
                                  const Vector2d& px, const Vector2d& predicted_px,
                                  const Matrix2d& prediction_covariance_px2) const noexcept;
  // In a later frame.
  [[nodiscard]] PatchMatch find_again(const PatchTracker& tracker, const GreyImage& image, const Vector2d& predicted_px,
                                      const Matrix2d& prediction_covariance_px2) const noexcept;

  // A match that one of the two gave is believed, or one of the first view.
  void drift_to(const PatchMatch& match) noexcept;
  void begin_at(double of_first_view_px2) noexcept {
    began_px2_ = of_first_view_px2;
    drift_px2_ = 0;
  }
  // Variances, per axis: of where the first view fitted last, and of what was drifted by since.
  [[nodiscard]] double began_px2() const noexcept { return began_px2_; }
  [[nodiscard]] double drift_px2() const noexcept { return drift_px2_; }

 private:
  PatchTemplate view_;
  std::uint64_t frame_ = 0;
  bool is_there_ = false;
  double began_px2_ = 0;
  double drift_px2_ = 0;
};

}  // namespace perimap
