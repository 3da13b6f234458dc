// The estimates of all slots, held in the precision that was chosen when it was made. What goes in and comes out is
// double in both: which it is, is asked once a group, and single precision is converted eight lanes at a time.
#pragma once

#include <cstddef>
#include <variant>
#include <vector>

#include "core/bank/feature_bank.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/estimation/precision.hpp"

namespace perimap {

// As FeatureBank, whose members say more. `phases` are always those of the group's last sweep.
class MapBank {
 public:
  MapBank(const BankSettings& settings, Precision precision);

  [[nodiscard]] const BasisLayout& layout() const noexcept { return layout_; }
  [[nodiscard]] int groups() const noexcept { return groups_; }

  void set(int feature, const FeatureEstimate& estimate) noexcept;
  void clear(int feature) noexcept;
  void get(int feature, FeatureEstimate& estimate) const noexcept;
  void get(int feature, StateVector& x) const noexcept;
  void diffuse(int feature, double deviation_mm) noexcept;

  void sweep(int group, const SweepPhases<double>& phases) noexcept;
  void motion(int group, const SweepPhases<double>& phases, int k, LaneMotions<double>& motions) noexcept;
  void motion_near(int group, const SweepPhases<double>& phases, int k, const SweepPhase<double>& at,
                   LaneMotions<double>& motions) noexcept;
  void position_gain(int feature, const SweepPhases<double>& phases, int k, PositionGain& M) noexcept;
  void update(int group, const SweepPhases<double>& phases, int k, const Pose& X_CW, const PixelModel& model,
              const LaneObservations<double>& observations, const UpdateSettings& settings,
              LaneOutcomes<double>& outcomes) noexcept;

 private:
  struct Double {
    FeatureBank<double> bank;
  };
  struct Single {
    FeatureBank<float> bank;
    std::vector<SweepPhases<float>> swept;  // of each group, converted once for all that is asked at them

    [[nodiscard]] const SweepPhases<float>& phases(int group) const noexcept {
      return swept[static_cast<std::size_t>(group)];
    }
  };
  using Banks = std::variant<Double, Single>;

  [[nodiscard]] static Banks make(const BankSettings& settings, Precision precision);

  Banks banks_;
  BasisLayout layout_;
  int groups_;
};

}  // namespace perimap
