#include "daemon/evaluation/experiment/shared_map.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/estimation/iterated_update.hpp"
#include "core/estimation/shared_pose.hpp"
#include "daemon/evaluation/experiment/accuracy_figures.hpp"
#include "daemon/evaluation/experiment/method.hpp"

namespace perimap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

}  // namespace

SharedMap::SharedMap(const Scene& scene, const BasisLayout& layout, const Prior& prior, PoseUse use, int buffered)
    : scene_(scene),
      layout_(layout),
      prior_(prior),
      use_(use),
      buffered_(static_cast<std::size_t>(buffered)),
      next_sighting_(scene.features.size(), 0),
      estimates_(scene.features.size()),
      pose_noise_(scene.features.size(),
                  CorrelatedPoseNoise(layout.state_size(), scene.settings.pose_error.correlation_s)),
      last_counted_frame_(scene.features.size(), 0) {}

void SharedMap::advance(int end_frame) {
  for (; next_frame_ < end_frame; ++next_frame_) take_frame(next_frame_);
}

void SharedMap::start(std::size_t i) {
  const auto& sightings = scene_.features[i].sightings;
  const auto method = make_method(MethodKind::kDelayed, {&scene_, layout_, prior_, scene_.settings.distance_mm},
                                  {.buffered = static_cast<int>(next_sighting_[i])});
  for (std::size_t k = 0; k < next_sighting_[i]; ++k) method->observe(sightings[k]);
  const FeatureEstimate* estimate = method->estimate();
  if (estimate == nullptr) return;
  estimates_[i] = *estimate;
  for (std::size_t k = 0; k < next_sighting_[i]; ++k) count_pose_noise(i, sightings[k], Learnt::kInBatch);
}

void SharedMap::count_pose_noise(std::size_t i, const Sighting& sighting, Learnt learnt) {
  if (use_ != PoseUse::kTrackerAlone) return;
  const PoseError& error = scene_.settings.pose_error;
  const SceneFrame& frame = scene_.frames[static_cast<std::size_t>(sighting.frame)];
  const Basis b = frame.basis(layout_);
  const Vector3d p = estimates_[i]->position(b);
  Vector2d z;
  MeasurementJacobians J;
  if (std::visit([&](const auto& model) { return measure(model, frame.X_CW, p, z, &J); }, scene_.model) !=
      ProjectionStatus::kOk)
    return;
  const double passed_s = (sighting.frame - last_counted_frame_[i]) / scene_.settings.frames_per_s;
  last_counted_frame_[i] = sighting.frame;
  PoseNoiseTerm term;
  term.b = b;
  term.M = position_gain(estimates_[i]->P, b);
  term.dz_dp = J.dz_dp;
  term.R = observation_of(scene_, layout_, sighting, p).R;
  term.dz_ds << J.dz_dtheta, J.dz_dc;
  Vector6d variances;
  variances << Vector3d::Constant(error.rotation_variance_rad2()), Vector3d::Constant(error.position_variance_mm2());
  term.sigma = variances.asDiagonal();
  pose_noise_[i].pass(passed_s);
  if (learnt == Learnt::kInBatch) {
    pose_noise_[i].add_of_batch(term);
  } else {
    pose_noise_[i].add(term);
  }
}

FeatureEstimate SharedMap::published(std::size_t i) const {
  return {estimates_[i]->x, estimates_[i]->P + pose_noise_[i].covariance()};
}

void SharedMap::take_frame(int frame) {
  const SceneFrame& scene_frame = scene_.frames[static_cast<std::size_t>(frame)];
  const Basis b = scene_frame.basis(layout_);
  std::vector<std::size_t> seen;
  std::vector<CommonMatch> matches;
  std::vector<std::size_t> waiting;
  for (std::size_t i = 0; i < estimates_.size(); ++i) {
    const auto& sightings = scene_.features[i].sightings;
    std::size_t& next = next_sighting_[i];
    if (next >= sightings.size() || sightings[next].frame != frame) continue;
    if (estimates_[i]) {
      seen.push_back(i);
      matches.push_back({sightings[next].z, scene_.match_covariance(), estimates_[i]->position(b),
                         estimates_[i]->position_covariance(b), AppendedMotion(3, 0)});
    } else {
      waiting.push_back(i);
    }
    ++next;
  }
  std::visit(
      [&](const auto& model) {
        const PoseError& error = scene_.settings.pose_error;
        const CommonInformation prior = tracker_prior(error.rotation_variance_rad2() * Matrix3d::Identity(),
                                                      error.position_variance_mm2() * Matrix3d::Identity());
        std::vector<std::uint8_t> used(matches.size(), 0);
        SharedPose shared;
        if (use_ == PoseUse::kTrackerAlone) {
          shared.estimate = solve_common(scene_frame.X_CW, prior);
        } else {
          shared = estimate_shared_pose(model, scene_frame.X_CW, prior, std::span<const CommonMatch>(matches),
                                        std::span(used));
        }
        for (std::size_t k = 0; k < matches.size(); ++k) {
          CommonEstimate pose = shared.estimate;
          if (use_ == PoseUse::kSharedOthers && used[k] != 0)
            pose = what_others_say(model, shared, scene_frame.X_CW, matches[k]);
          if (!pose.ok) continue;
          const CommonTerm term = linearise(model, pose, matches[k]);
          if (!term.visible) continue;
          const Observation observation{matches[k].z, matches[k].R + common_noise(term.J_s, pose.covariance), b,
                                        pose.X_CW};
          const std::size_t i = seen[k];
          if (iterated_update(*estimates_[i], observation, model).accepted)
            count_pose_noise(i, scene_.features[i].sightings[next_sighting_[i] - 1], Learnt::kByUpdate);
        }
      },
      scene_.model);
  for (const std::size_t i : waiting) {
    if (next_sighting_[i] >= buffered_ && next_sighting_[i] % (buffered_ / 2) == 0) start(i);
  }
}

namespace {

// What features that are no further apart than a heart is large have in common, put into the information of their
// separate priors.
void join_priors(const Scene& scene, JointPrior joint, Index n, MatrixXd& information) {
  const auto features = static_cast<Index>(scene.features.size());
  const Index d = 3 * n;
  if (joint == JointPrior::kCommonPart) {
    // Covariance sigma^2 (I + 1 1^T) over the features, so information (I - 1 1^T / (1 + features)) / sigma^2.
    for (Index coefficient = 0; coefficient < d; ++coefficient) {
      const double shared = information(coefficient, coefficient) / static_cast<double>(1 + features);
      for (Index row = 0; row < features; ++row) {
        for (Index column = 0; column < features; ++column)
          information(row * d + coefficient, column * d + coefficient) -= shared;
      }
    }
  }
  if (joint == JointPrior::kAffine) {
    constexpr double kRadius_mm = 40.0, kOwn = 0.01;
    Eigen::Matrix3Xd rest(3, features);
    for (Index i = 0; i < features; ++i) {
      const StateVector& x = scene.features[static_cast<std::size_t>(i)].x;
      for (Index axis = 0; axis < 3; ++axis) rest(axis, i) = x(axis * scene.layout.size()) / kRadius_mm;
    }
    MatrixXd together = 0.5 * (rest.transpose() * rest);
    together.array() += 0.5;
    together.diagonal().array() += kOwn;
    const MatrixXd inverse = together.inverse();
    for (Index coefficient = 0; coefficient < d; ++coefficient) {
      if (coefficient % n == 0) continue;
      const double own = information(coefficient, coefficient);
      for (Index row = 0; row < features; ++row) {
        for (Index column = 0; column < features; ++column)
          information(row * d + coefficient, column * d + coefficient) = own * inverse(row, column);
      }
    }
  }
}

}  // namespace

std::vector<FeatureEstimate> joint_cramer_rao_bound(const Scene& scene, const BasisLayout& layout, const Prior& prior,
                                                    JointPrior joint, int end_frame) {
  const Index n = layout.size();
  const auto features = static_cast<Index>(scene.features.size());
  const Index d = 3 * n;
  std::vector<FeatureEstimate> bounds;
  MatrixXd information = MatrixXd::Zero(d * features, d * features);
  for (Index i = 0; i < features; ++i) {
    bounds.push_back(cramer_rao_bound(scene, scene.features[static_cast<std::size_t>(i)], layout, prior, 0));
    information.diagonal().segment(i * d, d) = bounds.back().P.diagonal().cwiseInverse();
  }
  join_priors(scene, joint, n, information);
  const PoseError& error = scene.settings.pose_error;
  const double keep =
      error.correlation_s > 0.0 ? std::exp(-1.0 / (scene.settings.frames_per_s * error.correlation_s)) : 0.0;
  const double drive = 1.0 - keep * keep;
  Vector6d tracker;  // information of the stationary error
  tracker << Vector3d::Constant(1.0 / error.rotation_variance_rad2()),
      Vector3d::Constant(1.0 / error.position_variance_mm2());
  const Matrix2d R_inverse = scene.match_covariance().inverse();

  // The poses' part of the information is block tridiagonal; its Cholesky factor is eliminated as the frames come. What
  // is left of the map is reduced by Y^T Y, Y in slabs of some frames.
  constexpr int kSlab = 16;
  MatrixXd slab = MatrixXd::Zero(6 * kSlab, d * features);
  MatrixXd last = MatrixXd::Zero(6, d * features);
  Matrix6d last_factor = Matrix6d::Identity();
  std::vector<std::size_t> next(scene.features.size(), 0);
  for (int frame = 0; frame < end_frame; ++frame) {
    const SceneFrame& at = scene.frames[static_cast<std::size_t>(frame)];
    const Basis b = at.basis(layout);
    const MatrixXd bb = b * b.transpose();
    const bool first = frame == 0;
    const bool final = frame == end_frame - 1;
    Matrix6d poses = Matrix6d(tracker.asDiagonal()) * ((1.0 + (first || final ? 0.0 : keep * keep)) / drive);
    if (first && final) poses = Matrix6d(tracker.asDiagonal());
    MatrixXd cross = MatrixXd::Zero(6, d * features);
    for (Index i = 0; i < features; ++i) {
      const SceneFeature& feature = scene.features[static_cast<std::size_t>(i)];
      std::size_t& k = next[static_cast<std::size_t>(i)];
      if (k >= feature.sightings.size() || feature.sightings[k].frame != frame) continue;
      const bool outlier = feature.sightings[k++].outlier;
      Vector2d z;
      MeasurementJacobians J;
      const Vector3d p = scene.true_position(feature, at);
      if (outlier || std::visit([&](const auto& model) { return measure(model, at.X_CW_true, p, z, &J); },
                                scene.model) != ProjectionStatus::kOk)
        continue;
      Eigen::Matrix<double, 2, 6> J_s;
      J_s << J.dz_dtheta, J.dz_dc;
      const Matrix3d G = J.dz_dp.transpose() * R_inverse * J.dz_dp;
      const Eigen::Matrix<double, 6, 3> C = J_s.transpose() * R_inverse * J.dz_dp;
      poses += J_s.transpose() * R_inverse * J_s;
      for (Index row = 0; row < 3; ++row) {
        for (Index column = 0; column < 3; ++column)
          information.block(i * d + row * n, i * d + column * n, n, n) += G(row, column) * bb;
        cross.middleCols(i * d + row * n, n) += C.col(row) * b.transpose();
      }
    }
    if (!first && keep > 0.0) {
      const Matrix6d off = Matrix6d(tracker.asDiagonal()) * (-keep / drive);
      // L_k,k-1 = off L_k-1^-T
      const Matrix6d coupling = last_factor.triangularView<Eigen::Lower>().solve(off.transpose()).transpose();
      poses -= coupling * coupling.transpose();
      cross -= coupling * last;
    }
    last_factor = poses.llt().matrixL();
    last = last_factor.triangularView<Eigen::Lower>().solve(cross);
    slab.middleRows(6 * (frame % kSlab), 6) = last;
    if (frame % kSlab == kSlab - 1 || final) {
      information.selfadjointView<Eigen::Lower>().rankUpdate(slab.transpose(), -1.0);
      slab.setZero();
    }
  }
  const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(information);
  for (Index i = 0; i < features; ++i) {
    MatrixXd unit = MatrixXd::Zero(d * features, d);
    unit.middleRows(i * d, d).setIdentity();
    // The columns of L^-1 above the feature's own rows are zero.
    factor.matrixL().solveInPlace(unit);
    bounds[static_cast<std::size_t>(i)].P = unit.transpose() * unit;
  }
  return bounds;
}

}  // namespace perimap
