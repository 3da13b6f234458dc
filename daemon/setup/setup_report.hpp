// What `perimap calibrate` and `perimap register` say of a result: as text, and as JSON.
//
// In JSON every measured figure NAME stands beside its standard deviation NAME_deviation, in the same unit and shape.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/calibration/landmark_registration.hpp"
#include "core/calibration/pivot.hpp"
#include "core/calibration/tracker_noise.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/signal_offset.hpp"

namespace perimap {

// A rotation's quaternion w x y z (w not negative) and the standard deviation of each, by the covariance of its error:
// a rotation vector about the axes of the turned frame, rad.
struct QuaternionFigures {
  double wxyz[4];
  double deviation[4];
};
[[nodiscard]] QuaternionFigures quaternion_figures(const Matrix3d& R, const Matrix3d& covariance);

struct TargetError {
  Vector3d target_I = Vector3d::Zero();  // mm
  double error_mm = 0.0;                 // expected, RMS
};

[[nodiscard]] std::string text_of(const HandEyeCalibration& result);
// Of a hand-eye calibration what it says of the clocks alone.
[[nodiscard]] std::string offset_text_of(const HandEyeCalibration& result);
[[nodiscard]] nlohmann::json offset_json_of(const HandEyeCalibration& result);
[[nodiscard]] std::string text_of(const SignalOffset& result);
[[nodiscard]] std::string text_of(const PivotCalibration& result);
[[nodiscard]] std::string text_of(const MeasuredNoise& result);
[[nodiscard]] std::string text_of(const LandmarkRegistration& result, const std::vector<Landmark>& landmarks,
                                  const std::vector<TargetError>& targets);

[[nodiscard]] nlohmann::json json_of(const HandEyeCalibration& result);
[[nodiscard]] nlohmann::json json_of(const SignalOffset& result);
[[nodiscard]] nlohmann::json json_of(const PivotCalibration& result);
[[nodiscard]] nlohmann::json json_of(const MeasuredNoise& result);
[[nodiscard]] nlohmann::json json_of(const LandmarkRegistration& result, const std::vector<Landmark>& landmarks,
                                     const std::vector<TargetError>& targets);

}  // namespace perimap
