// Position, velocity and covariance of all features of a bank at one instant.
#pragma once

#include <vector>

#include "core/bank/feature_bank.hpp"

namespace perimap {

// Keeps room for all groups, so predicting allocates nothing. Different groups may be predicted by different threads at
// once.
template <class Real>
class MotionPredictor {
 public:
  explicit MotionPredictor(int groups) : motions_(static_cast<std::size_t>(groups)) {}

  // At phase k of the bank's last sweep, whose phases these must be: hardly more than reading it off.
  void predict(FeatureBank<Real>& bank, int group, const SweepPhases<Real>& phases, int k) noexcept {
    bank.motion(group, phases, k, motions_[static_cast<std::size_t>(group)]);
  }
  // At any instant: a pass that reads P once.
  void predict_at(const FeatureBank<Real>& bank, int group, const SweepPhase<Real>& phase) noexcept {
    bank.motion_at(group, phase, motions_[static_cast<std::size_t>(group)]);
  }

  [[nodiscard]] const LaneMotions<Real>& operator[](int group) const noexcept {
    return motions_[static_cast<std::size_t>(group)];
  }

 private:
  std::vector<LaneMotions<Real>> motions_;
};

}  // namespace perimap
