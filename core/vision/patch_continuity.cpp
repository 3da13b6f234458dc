#include "core/vision/patch_continuity.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace perimap {

bool PatchContinuity::is_plausible(const PatchState& before, const PatchState& now, double correlation,
                                   double usual_frames) const noexcept {
  if (usual_correlation_ <= 0) return true;
  // What is missing to 1 may be some times the usual (blur, smoke, a slanted view come within a few frames), and a
  // little more where nearly nothing is missing.
  constexpr double kTimesUsual = 3.0, kAlways = 0.02;
  if (1 - correlation > kTimesUsual * (1 - usual_correlation_) + kAlways) return false;
  // A systole stretches the picture by up to 1.1 in a frame at the usual rate, and noise the shape that is found,
  // however short the time.
  constexpr double kStretch = 1.25, kFramesCounted = 3;
  const double stretch = std::pow(kStretch, std::clamp(usual_frames, 1.0, kFramesCounted));
  const StretchRange change = stretch_of(now.A * before.A.inverse());
  return change.largest <= stretch && change.smallest * stretch >= 1;
}

void PatchContinuity::add(double correlation) noexcept {
  constexpr double kShareOfNew = 0.1;
  usual_correlation_ =
      usual_correlation_ <= 0 ? correlation : usual_correlation_ + kShareOfNew * (correlation - usual_correlation_);
}

}  // namespace perimap
