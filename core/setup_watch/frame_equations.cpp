#include "core/setup_watch/frame_equations.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

#include "core/estimation/student_t_loss.hpp"

namespace perimap {
namespace {

using FrameMatrix = Eigen::Matrix<double, kFrameUnknowns, kFrameUnknowns>;

// A prior of no deviation at all could not be inverted.
constexpr double kLeastPhaseDeviation_s = 1e-6;
constexpr double kLeastPosition_mm2 = 1e-8;
constexpr double kLeastRotation_rad2 = 1e-12;
// After so many the weights of Student's t hardly change.
constexpr int kRobustPasses = 3;

struct Linearised {
  int feature = 0;
  Vector2d r;
  Matrix23d J_p;
  Eigen::Matrix<double, 2, kSetupNumbers> J_d;
  Eigen::Matrix<double, 2, kFrameUnknowns> J_s;
  Matrix2d R_inverse;
};

// The frame at an iterate.
struct Iterate {
  FrameVector s;
  Pose X_CW;
  Vector3d lever_W_mm;
  Basis b;
  CameraModel camera;
  Matrix3d turned_back;  // from the configured camera's axes into the corrected one's
  CameraTwist twist;     // of the corrected camera, in the configured one's axes
};

Iterate iterate_at(const WatchedFrame& frame, const CameraModel& camera, const SetupVector& deviation,
                   const FrameVector& s) {
  const Matrix3d turned = so3_exp(s.head<3>());
  Iterate at;
  at.s = s;
  at.lever_W_mm = turned * frame.lever_W_mm;
  const Pose X_WC{turned * frame.X_WC.R, frame.X_WC.t - frame.lever_W_mm + at.lever_W_mm + s.segment<3>(3)};
  at.X_CW = corrected(X_WC, frame.twist, deviation).inverse();
  at.b = frame.b + s(6) * frame.b_rate;
  at.camera = corrected(camera, deviation);
  at.turned_back = so3_exp(-deviation.segment<3>(kTurnAt));
  const Vector3d moved_C_mm = deviation.segment<3>(kMoveAt);
  at.twist = frame.twist;
  at.twist.move_C_mm_per_s += frame.twist.turn_C_rad_per_s.cross(moved_C_mm);
  return at;
}

// When the camera turns by theta and moves by d in its own frame, q = p_CF becomes exp(-[theta]x)(q - d).
bool linearise(const WatchedFrame& frame, const WatchedMatch& match, const StateVector& x, const Iterate& at,
               Linearised& l) {
  const Vector3d q = at.X_CW * position_of(x, at.b);
  Vector2d px;
  Matrix23d J_q;
  if (at.camera.project(q, px, &J_q) != ProjectionStatus::kOk) return false;
  l.feature = match.feature;
  l.R_inverse = match.covariance_px2.inverse();
  if (!match.px.allFinite() || !l.R_inverse.allFinite()) return false;
  l.J_p = J_q * at.X_CW.R;
  const Matrix23d by_turn = J_q * cross_matrix(q);
  const Matrix23d by_move = -J_q * at.turned_back;
  l.J_d.middleCols<3>(kTurnAt) = by_turn;
  l.J_d.middleCols<3>(kMoveAt) = by_move;
  l.J_d.col(kFocalAt) = px - Vector2d(at.camera.cx, at.camera.cy);
  l.J_d.middleCols<2>(kPrincipalPointAt).setIdentity();
  l.J_d.col(kTimeAt) = by_turn * at.turned_back * at.twist.turn_C_rad_per_s + by_move * at.twist.move_C_mm_per_s;
  // The sensor turns about itself, which takes the camera along by the lever.
  l.J_s.leftCols<3>() = J_q * cross_matrix(q + at.X_CW.R * at.lever_W_mm) * at.X_CW.R;
  l.J_s.middleCols<3>(3) = -l.J_p;
  l.J_s.col(6) = l.J_p * position_of(x, frame.b_rate);
  l.r = match.px - px + l.J_s * at.s;
  return true;
}

FrameMatrix information_of_s(const std::vector<Linearised>& matches, const std::vector<double>& weights,
                             const FrameVector& prior) {
  FrameMatrix information = prior.cwiseInverse().asDiagonal();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    information += weights[i] * matches[i].J_s.transpose() * matches[i].R_inverse * matches[i].J_s;
  }
  return information;
}

// Of each match, beside the pose and the phase that the frame's matches agree on.
std::vector<double> squared_residuals(const std::vector<Linearised>& matches, const std::vector<double>& weights,
                                      const FrameVector& prior) {
  FrameVector pull = FrameVector::Zero();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    pull += weights[i] * matches[i].J_s.transpose() * matches[i].R_inverse * matches[i].r;
  }
  const FrameVector s = information_of_s(matches, weights, prior).llt().solve(pull);
  std::vector<double> squares;
  for (const Linearised& match : matches) {
    const Vector2d rest = match.r - match.J_s * s;
    squares.push_back(rest.dot(match.R_inverse * rest));
  }
  return squares;
}

std::vector<double> weights_of(const std::vector<Linearised>& matches, const FrameVector& prior,
                               MatchWeighting weighting, double gate) {
  std::vector<double> weights(matches.size(), 1.0);
  std::vector<double> squares;
  for (int pass = 0; pass < kRobustPasses; ++pass) {
    squares = squared_residuals(matches, weights, prior);
    std::transform(squares.begin(), squares.end(), weights.begin(), student_t_weight);
  }
  if (weighting == MatchWeighting::kStudent) return weights;
  squares = squared_residuals(matches, weights, prior);
  std::transform(squares.begin(), squares.end(), weights.begin(),
                 [gate](double square) { return square <= gate ? 1.0 : 0.0; });
  return weights;
}

FrameEquations stack(const std::vector<Linearised>& matches, const std::vector<double>& weights,
                     const FrameVector& prior) {
  FrameEquations e;
  const auto rows = 2 * static_cast<Eigen::Index>(
                            std::count_if(weights.begin(), weights.end(), [](double weight) { return weight > 0.0; }));
  e.J_d.resize(rows, kSetupNumbers);
  e.J_s.resize(rows, kFrameUnknowns);
  e.r.resize(rows);
  e.W = Eigen::MatrixXd::Zero(rows, rows);
  Eigen::Matrix<double, Eigen::Dynamic, kFrameUnknowns> weighted_J_s(rows, kFrameUnknowns);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!(weights[i] > 0.0)) continue;
    const Linearised& match = matches[i];
    const Matrix2d R_inverse = weights[i] * match.R_inverse;
    e.features.push_back(match.feature);
    e.J_p.push_back(match.J_p);
    e.R.emplace_back(R_inverse.inverse());
    e.J_d.middleRows<2>(row) = match.J_d;
    e.J_s.middleRows<2>(row) = match.J_s;
    e.r.segment<2>(row) = match.r;
    e.W.block<2, 2>(row, row) = R_inverse;
    weighted_J_s.middleRows<2>(row) = R_inverse * match.J_s;
    row += 2;
  }
  const FrameMatrix information = information_of_s(matches, weights, prior);
  e.gain = information.llt().solve(weighted_J_s.transpose());
  e.W.noalias() -= weighted_J_s * e.gain;
  return e;
}

}  // namespace

FrameVector prior_variances(const WatchedFrame& frame) noexcept {
  const double phase_s = std::max(frame.phase_deviation_s, kLeastPhaseDeviation_s);
  FrameVector variances;
  variances << Vector3d::Constant(std::max(frame.rotation_variance_rad2, kLeastRotation_rad2)),
      Vector3d::Constant(std::max(frame.position_variance_mm2, kLeastPosition_mm2)), phase_s * phase_s;
  return variances;
}

FrameEquations frame_equations(const WatchedFrame& frame, const std::vector<StateVector>& x, const CameraModel& camera,
                               const SetupVector& deviation, const FrameVector& s, MatchWeighting weighting,
                               double gate) {
  const Iterate at = iterate_at(frame, camera, deviation, s);
  std::vector<Linearised> matches;
  for (const WatchedMatch& match : frame.matches) {
    Linearised l;
    if (linearise(frame, match, x[static_cast<std::size_t>(match.feature)], at, l)) matches.push_back(l);
  }
  const FrameVector prior = prior_variances(frame);
  FrameEquations e = stack(matches, weights_of(matches, prior, weighting, gate), prior);
  e.b = at.b;
  return e;
}

}  // namespace perimap
