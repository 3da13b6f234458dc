// Hand-eye calibration in closed form, AX = XB: a start for the adjustment, good enough to tell outliers by.
#pragma once

#include <optional>
#include <vector>

#include "core/calibration/timed_poses.hpp"

namespace perimap {

// The sensor S in the tracker's frame W and the camera C in the frame B of a board that stays where it is, at one time.
struct PosePair {
  double t_s = 0.0;                     // on the camera's clock
  Pose X_WS;                            // mm
  Pose X_BC;                            // mm
  Vector6d twist_S = Vector6d::Zero();  // the sensor's motion, in S: rad/s, then mm/s; zero where it is not known
};

// X_SC by the rotations of pairs of poses (Park & Martin, "Robot sensor calibration: solving AX = XB on the Euclidean
// group", IEEE Trans. Robotics and Automation 10(5), 1994), then by least squares over their translations. Pairs whose
// two rotations are of different angles, which no hand-eye explains, and what fits worst is left out. None with fewer
// than three poses or without rotation.
[[nodiscard]] std::optional<Pose> hand_eye_closed_form(const std::vector<PosePair>& pairs);

// X_WB, the board in W, by the poses that agree: the medians of the translations, and of the rotations about the first.
[[nodiscard]] Pose board_in_world(const std::vector<PosePair>& pairs, const Pose& X_SC);

// The error of AX = XB: (sensor's error rotation, rad; translation, mm), in S. Zero for exact poses.
[[nodiscard]] Vector6d hand_eye_error(const PosePair& pair, const Pose& X_SC, const Pose& X_WB) noexcept;

// The translation of AX - XB between two times, mm: A is the sensor's motion, B the camera's.
[[nodiscard]] double motion_disagreement_mm(const PosePair& first, const PosePair& second, const Pose& X_SC) noexcept;

}  // namespace perimap
