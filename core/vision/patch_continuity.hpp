// Whether what was found looks as the feature has looked: the test of a match that no narrow prediction vouches for.
#pragma once

#include "core/vision/patch_tracker.hpp"

namespace perimap {

// How a feature usually looks, from the matches that were believed.
class PatchContinuity {
 public:
  // With a new template.
  void reset() noexcept { usual_correlation_ = 0; }

  // Whether a match can be what was seen so long ago as `before`, and now as `now`. A feature that leaves the view or
  // is covered often has a look-alike within a wide search region: it fits the template far worse than the feature used
  // to, or in a shape that no tissue turns into within so short a time. `usual_frames`: that time, in frames at the
  // usual rate.
  [[nodiscard]] bool is_plausible(const PatchState& before, const PatchState& now, double correlation,
                                  double usual_frames) const noexcept;

  // A match that was believed.
  void add(double correlation) noexcept;

 private:
  double usual_correlation_ = 0;  // smoothed over some 10 matches; 0 before the first
};

}  // namespace perimap
