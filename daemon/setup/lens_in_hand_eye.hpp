// What the uncertainty of a lens makes of the hand-eye that is measured through it.
#pragma once

#include <vector>

#include "core/geometry/camera_model.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "drivers/calibration/lens_covariance.hpp"

namespace perimap {

// A principal point that is off turns every pose of the camera alike, a focal length moves them along the line of
// sight: the hand-eye is measured anew with the lens changed by a deviation along each axis of its covariance, and what
// that changes is added to the result's. `views`: those that its camera poses were made of, on the same clock; two a
// second of them tell it. The clocks' offset is left as certain as it is. Where that can not be worked out the result
// is as before, but for `lens_untold`, which says why.
void add_lens_uncertainty(HandEyeCalibration& result, const std::vector<TimedView>& views, const CameraModel& lens,
                          const LensCovariance& covariance);

}  // namespace perimap
