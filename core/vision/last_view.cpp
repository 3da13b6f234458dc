#include "core/vision/last_view.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/vision/way_back.hpp"

namespace perimap {

void LastView::make(const GreyImage& image, std::uint64_t frame, const Vector2d& px,
                    const PatchKernels& kernels) noexcept {
  if (is_of(frame)) return;
  is_there_ = make_view(image, px, kernels, view_);
  frame_ = frame;
}

PatchMatch LastView::follow(const PatchTracker& tracker, const GreyImage& image, const GreyImage& before,
                            const Vector2d& px, const Vector2d& predicted_px,
                            const Matrix2d& prediction_covariance_px2) const noexcept {
  PatchState state;
  PatchMatch match = tracker.track(image, view_, state, predicted_px, prediction_covariance_px2);
  if (match.state != MatchState::kFound) return match;
  const double deviation_px = std::sqrt(larger_eigenvalue(prediction_covariance_px2));
  const auto off_px = off_on_way_back(tracker, image, match.px, {before, px, predicted_px, deviation_px});
  if (!off_px || *off_px >= kMostOffOnWayBack_px) match.state = MatchState::kTooFar;
  match.covariance_px2 += (began_px2_ + drift_px2_) * Matrix2d::Identity();
  return match;
}

PatchMatch LastView::find_again(const PatchTracker& tracker, const GreyImage& image, const Vector2d& predicted_px,
                                const Matrix2d& prediction_covariance_px2) const noexcept {
  PatchState state;
  PatchMatch match = tracker.track(image, view_, state, predicted_px, prediction_covariance_px2);
  if (match.state == MatchState::kFound && match.correlation < kLeastCorrelationOfReturn) {
    match.state = MatchState::kLowCorrelation;
  }
  match.covariance_px2 += (began_px2_ + drift_px2_) * Matrix2d::Identity();
  return match;
}

// Its covariance has what had been before.
void LastView::drift_to(const PatchMatch& match) noexcept {
  drift_px2_ = std::max(0.0, larger_eigenvalue(match.covariance_px2) - began_px2_);
}

}  // namespace perimap
