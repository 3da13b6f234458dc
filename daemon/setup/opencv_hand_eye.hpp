// OpenCV's own solutions of AX = XB, to be printed beside ours.
#pragma once

#include "daemon/setup/hand_eye.hpp"

namespace perimap {

// By each of cv::calibrateHandEye's methods, over at most sixty of the pairs, evenly chosen, as its cost grows with
// their square; residuals not yet judged.
[[nodiscard]] std::vector<OtherHandEye> opencv_hand_eyes(const std::vector<PosePair>& pairs);

}  // namespace perimap
