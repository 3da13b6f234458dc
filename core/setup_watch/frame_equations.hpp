// What one frame's matches say of the features' positions and of the set-up, when what is the frame's alone has been
// eliminated: the error of its pose (6 numbers) and of its cardiac phase.
//
// Linearised at a set-up, at the features' motions and at the frame's own error s_0, a frame with m matches has
//
//   r = z - h + J_s s_0 = J_p dp + J_d ddelta + J_s s + e,   s ~ N(0, Sigma),   e ~ N(0, R),
//
// dp being the 3 m coordinates of its features. (At s_0 = 0 the derivatives would err with the very poses whose errors
// they are to explain, and the estimate would be off by many of its deviations: a sensor that turns by mistake takes a
// camera along as if the hand-eye transform were shorter.) Without s the weight of the residuals is
//
//   W = (R + J_s Sigma J_s^T)^-1 = R^-1 - R^-1 J_s (Sigma^-1 + J_s^T R^-1 J_s)^-1 J_s^T R^-1.
//
// Not for the real-time path: it allocates.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/setup_watch/setup_deviation.hpp"
#include "core/setup_watch/watched_window.hpp"

namespace perimap {

inline constexpr int kFrameUnknowns = 7;  // s: the sensor's turn (rad, W), its move (mm, W), the phase (s)
using FrameVector = Eigen::Matrix<double, kFrameUnknowns, 1>;

// Of s, before any match.
[[nodiscard]] FrameVector prior_variances(const WatchedFrame& frame) noexcept;

enum class MatchWeighting : std::uint8_t {
  kStudent,  // of Student's t, which lets go of gross outliers
  kGate      // 1 within the gate, 0 beyond
};

struct FrameEquations {
  Basis b;                     // at the phase of s_0
  std::vector<int> features;   // of the matches that count, m of them
  std::vector<Matrix23d> J_p;  // px/mm, a match each
  std::vector<Matrix2d> R;     // px^2, a match each; divided by its weight
  Eigen::MatrixXd J_d;         // 2m x kSetupNumbers
  Eigen::MatrixXd J_s;         // 2m x kFrameUnknowns
  Eigen::MatrixXd W;           // 2m x 2m, 1/px^2
  Eigen::VectorXd r;           // 2m, px
  Eigen::MatrixXd gain;        // kFrameUnknowns x 2m: s = gain (r - J_p dp - J_d ddelta)

  [[nodiscard]] int matches() const noexcept { return static_cast<int>(features.size()); }
};

// Matches that can not be seen there, or lie beyond the gate, are left out. `x`: the features' coefficients,
// `deviation`: the set-up, and `s`: the frame's own error at this iterate. `gate`: squared and normalised, beside the
// pose that the frame's matches agree on.
[[nodiscard]] FrameEquations frame_equations(const WatchedFrame& frame, const std::vector<StateVector>& x,
                                             const CameraModel& camera, const SetupVector& deviation,
                                             const FrameVector& s, MatchWeighting weighting, double gate);

}  // namespace perimap
