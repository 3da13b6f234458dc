// All features of a trial followed together, frame by frame, so that a frame's matches can say where its camera was.
#pragma once

#include <optional>
#include <vector>

#include "core/estimation/correlated_pose_noise.hpp"
#include "core/estimation/feature_estimate.hpp"
#include "daemon/evaluation/experiment/scene.hpp"

namespace perimap {

enum class PoseUse : std::uint8_t {
  kTrackerAlone,  // the pose's noise enters each match's covariance
  kSharedNaive,   // the pose of all matches, then each match once more for its feature: counted twice
  kSharedOthers   // the pose of all matches but the feature's own
};

class SharedMap {
 public:
  // Features start after `buffered` sightings, from the tracker's poses.
  SharedMap(const Scene& scene, const BasisLayout& layout, const Prior& prior, PoseUse use, int buffered = 60);

  // Takes the frames up to, not including, this one.
  void advance(int end_frame);

  // Of feature i; nothing before its start.
  [[nodiscard]] const std::optional<FeatureEstimate>& estimate(std::size_t i) const { return estimates_[i]; }
  // The same with the common part of the pose's error, which its correlation time keeps from averaging out, counted
  // into the covariance. For kTrackerAlone.
  [[nodiscard]] FeatureEstimate published(std::size_t i) const;
  [[nodiscard]] std::size_t size() const noexcept { return estimates_.size(); }

 private:
  void take_frame(int frame);
  void start(std::size_t i);
  // Counts a sighting that the estimate was made from, by an update or in the batch start.
  enum class Learnt : std::uint8_t { kByUpdate, kInBatch };
  void count_pose_noise(std::size_t i, const Sighting& sighting, Learnt learnt);

  const Scene& scene_;
  BasisLayout layout_;
  Prior prior_;
  PoseUse use_;
  std::size_t buffered_;
  int next_frame_ = 0;
  std::vector<std::size_t> next_sighting_;
  std::vector<std::optional<FeatureEstimate>> estimates_;
  std::vector<CorrelatedPoseNoise> pose_noise_;
  std::vector<int> last_counted_frame_;
};

// How the features' states x_i are supposed to belong together before any sighting.
enum class JointPrior : std::uint8_t {
  // Independent, each with the prior's covariance: the mean of N features is then supposed to move by the N-th part of
  // one feature's variance, which no heart does.
  kIndependent,
  // x_i = c + d_i, where c and every d_i are independent and have the prior's covariance each: the mean is as free as
  // one feature's state, the differences between features are as kIndependent has them.
  kCommonPart,
  // Each coefficient of the motion is an affine function of the place at rest, as the ellipsoid's truth is (scene.cpp):
  // half of its variance is common to all, half goes with the place over 40 mm. A hundredth is each feature's own. Rest
  // positions are independent.
  kAffine
};

// Posterior Cramer-Rao bound of all features together when the pose errors are unknowns too, with their true
// statistics: covariance of feature i's state, mm^2. Sightings before `end_frame`, outliers left out.
[[nodiscard]] std::vector<FeatureEstimate> joint_cramer_rao_bound(const Scene& scene, const BasisLayout& layout,
                                                                  const Prior& prior, JointPrior joint, int end_frame);

}  // namespace perimap
