// Pictures of what a calibration leaves over, for its page.
#pragma once

#include <string>
#include <vector>

#include "core/calibration/landmark_registration.hpp"
#include "core/calibration/pivot.hpp"
#include "core/calibration/time_correlation.hpp"
#include "core/calibration/tracker_noise.hpp"
#include "daemon/pages/svg_plot.hpp"
#include "daemon/setup/camera_calibration.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/signal_offset.hpp"

namespace perimap {

[[nodiscard]] std::vector<Plot> plots_of(const HandEyeCalibration& result);
[[nodiscard]] std::vector<Plot> plots_of(const CameraCalibration& result);
// Both signals, the second one on the first one's clock and scale.
[[nodiscard]] std::vector<Plot> plots_of(const SignalOffset& result, const std::vector<TimedValue>& first,
                                         const std::vector<TimedValue>& second);
[[nodiscard]] std::vector<Plot> plots_of(const PivotCalibration& result, const std::vector<TimedPose>& poses);
[[nodiscard]] std::vector<Plot> plots_of(const MeasuredNoise& result);
[[nodiscard]] std::vector<Plot> plots_of(const LandmarkRegistration& result);

// One page: the text as it is printed, and the pictures below.
[[nodiscard]] std::string setup_page(const std::string& title, const std::string& text, const std::vector<Plot>& plots);

}  // namespace perimap
