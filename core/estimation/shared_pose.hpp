// What all matches of one frame have in common: the tracker's error of the camera pose, and what else a caller appends
// (an error of the cardiac phase moves every feature along its velocity).
//
// The common unknowns are s = [theta, delta_c, appended...] with
//
//   R_CW <- exp([theta]x) R_CW,   c <- c + delta_c,   p_WF <- p_WF + D s_appended,
//
// theta in rad, frame C; c = p_WC and delta_c in mm, frame W; D is the match's own (3 x appended). The tracker is the
// prior of s, mean zero. A match of feature j says
//
//   z_j - h(s, p_j) ~ N(0, C_j),   C_j = R_j + J_p S_j J_p^T,   S_j = B P_j B^T,
//
// so the map is as uncertain as it says. Gauss-Newton: each match adds J_s^T C_j^-1 J_s to the information and J_s^T
// C_j^-1 (r_j + J_s s) to its vector; nothing larger than 8 x 8 is ever formed, and partial sums of any groups of
// matches add up. theta is taken as additive, which holds to first order: errors of trackers are a few degrees at most.
//
// Using a match for the pose and then again for its feature would count it twice. Since sums can be taken apart, the
// feature's own term is subtracted first: what_others_say() is the pose from all other matches, exactly.
//
// No heap, deterministic.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/estimation/measurement_model.hpp"

namespace perimap {

inline constexpr int kPoseUnknowns = 6;
inline constexpr int kMaxAppended = 2;
inline constexpr int kMaxCommon = kPoseUnknowns + kMaxAppended;

using CommonVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxCommon, 1>;
using CommonMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxCommon, kMaxCommon>;
using CommonJacobian = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMaxCommon>;
using AppendedMotion = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxAppended>;

// A match and what the map says of its feature at the frame's phase.
struct CommonMatch {
  Vector2d z = Vector2d::Zero();      // as in Observation
  Matrix2d R = Matrix2d::Identity();  // of the match alone, without pose noise
  Vector3d p_WF = Vector3d::Zero();   // mm
  Matrix3d S = Matrix3d::Zero();      // mm^2, frame W
  AppendedMotion D;                   // d p_WF / d s_appended; no columns when nothing is appended
};

// A term of the normal equations, or a sum of terms.
struct CommonInformation {
  CommonMatrix Lambda;  // symmetric bit by bit
  CommonVector eta;

  [[nodiscard]] static CommonInformation zero(Eigen::Index unknowns) noexcept {
    return {CommonMatrix::Zero(unknowns, unknowns), CommonVector::Zero(unknowns)};
  }
  CommonInformation& operator+=(const CommonInformation& other) noexcept {
    Lambda += other.Lambda;
    eta += other.eta;
    return *this;
  }
  CommonInformation& operator-=(const CommonInformation& other) noexcept {
    Lambda -= other.Lambda;
    eta -= other.eta;
    return *this;
  }
};

// The prior of the tracker: independent errors of rotation (rad^2, frame C) and centre (mm^2, frame W).
[[nodiscard]] CommonInformation tracker_prior(const Matrix3d& sigma_theta, const Matrix3d& sigma_c) noexcept;
// The same with an unknown appended that has mean zero and this variance.
[[nodiscard]] CommonInformation with_appended(const CommonInformation& prior, double variance) noexcept;

struct CommonEstimate {
  CommonVector s;
  CommonMatrix covariance;
  Pose X_CW;        // the tracker's, corrected by s
  bool ok = false;  // false: the information was not positive definite or not finite; the rest is not to be used
};

// Solves the sum of the prior and the matches; X_CW is the tracker's pose.
[[nodiscard]] CommonEstimate solve_common(const Pose& X_CW, const CommonInformation& information) noexcept;

// One match at an iterate.
struct CommonTerm {
  CommonInformation information;  // with weight 1
  CommonJacobian J_s;             // dz/ds
  Vector2d r = Vector2d::Zero();  // the residual at the iterate
  // r^T (C + J_s covariance J_s^T)^-1 r: of the residual at the iterate, given how well s is known there.
  double squared_residual = 0.0;
  bool visible = false;  // false: the feature can't be seen from there, or a number is bad; the information is zero
};

template <class Model>
[[nodiscard]] CommonTerm linearise(const Model& model, const CommonEstimate& at, const CommonMatch& match) noexcept;

struct SharedPoseSettings {
  int robust_iterations = 3;  // weights of Student's t with 3 degrees of freedom, wide first, narrow as s becomes known
  int final_iterations = 2;   // of what lies within the gate, with weight 1
  double gate = 13.8;         // chi-squared, 2 degrees of freedom, 99.9 %
};

struct SharedPose {
  CommonEstimate estimate;
  CommonInformation information;  // prior and all used matches, linearised at `linearised_at`
  CommonEstimate linearised_at;   // where the last terms were taken; what_others_say() takes them again there
  int used = 0;                   // matches within the gate
};

// All iterations on one thread. Terms are summed in groups of kCommonGroup matches and the groups in order, so workers
// that keep the sums of their groups reproduce it bit by bit. `used[k]` (as long as matches, or empty) becomes 1 where
// match k counted. Without a solution the estimate's `ok` is false.
inline constexpr std::size_t kCommonGroup = 8;
template <class Model>
[[nodiscard]] SharedPose estimate_shared_pose(const Model& model, const Pose& X_CW, const CommonInformation& prior,
                                              std::span<const CommonMatch> matches, std::span<std::uint8_t> used = {},
                                              const SharedPoseSettings& settings = {}) noexcept;

// The common unknowns from all matches but this one, which must have been `used`. The same as a solution without it at
// the same linearisation. For a match that was not used, `shared.estimate` is that already.
template <class Model>
[[nodiscard]] CommonEstimate what_others_say(const Model& model, const SharedPose& shared, const Pose& X_CW,
                                             const CommonMatch& match) noexcept;

// What the uncertainty of the common unknowns adds to a match's covariance: J_s covariance J_s^T.
[[nodiscard]] Matrix2d common_noise(const CommonJacobian& J_s, const CommonMatrix& covariance) noexcept;

extern template CommonTerm linearise(const PixelModel&, const CommonEstimate&, const CommonMatch&) noexcept;
extern template SharedPose estimate_shared_pose(const PixelModel&, const Pose&, const CommonInformation&,
                                                std::span<const CommonMatch>, std::span<std::uint8_t>,
                                                const SharedPoseSettings&) noexcept;
extern template CommonEstimate what_others_say(const PixelModel&, const SharedPose&, const Pose&,
                                               const CommonMatch&) noexcept;
extern template CommonTerm linearise(const BearingModel&, const CommonEstimate&, const CommonMatch&) noexcept;
extern template SharedPose estimate_shared_pose(const BearingModel&, const Pose&, const CommonInformation&,
                                                std::span<const CommonMatch>, std::span<std::uint8_t>,
                                                const SharedPoseSettings&) noexcept;
extern template CommonEstimate what_others_say(const BearingModel&, const SharedPose&, const Pose&,
                                               const CommonMatch&) noexcept;

}  // namespace perimap
