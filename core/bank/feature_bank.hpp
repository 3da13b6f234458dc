// Many features' estimates as a structure of arrays, eight features side by side in a group, so that one instruction
// serves eight of them: all features of a frame share the phase, hence the basis.
//
// Life of a group in a frame: one sweep() over its covariances, the only expensive pass, which also applies the updates
// that the previous frame left pending; then motion() and update() at the sweep's phases in any order. An update
// changes x and the variances at once, but P elsewhere only at the next sweep; until then everything that is read is
// corrected for it. So learning from several held frames costs one sweep, not several.
//
// Nothing is allocated after construction, nothing locks or throws. Groups share nothing that is written: different
// threads may work on different groups at once. No result depends on the number of groups, on a feature's place or on
// what the other lanes hold.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <new>
#include <vector>

#include "core/bank/group_view.hpp"
#include "core/bank/lanes.hpp"
#include "core/bank/sweep_kernels.hpp"
#include "core/bank/sweep_phases.hpp"
#include "core/bank/update_kernels.hpp"
#include "core/estimation/feature_estimate.hpp"
#include "core/simd/simd_target.hpp"

namespace perimap {

struct BankSettings {
  BasisLayout layout;
  int features = 0;  // rounded up to whole groups
  SimdTarget target = best_simd_target();
};

template <class Real>
class FeatureBank {
 public:
  explicit FeatureBank(const BankSettings& settings);

  [[nodiscard]] const BasisLayout& layout() const noexcept { return layout_; }
  [[nodiscard]] int groups() const noexcept { return static_cast<int>(groups_.size()); }
  [[nodiscard]] int features() const noexcept { return groups() * kLanes; }

  // Feature f lies in group f / kLanes, lane f % kLanes. One that is set takes part from the next sweep on.
  void set(int feature, const FeatureEstimate& estimate) noexcept;
  void clear(int feature) noexcept;
  [[nodiscard]] bool occupied(int feature) const noexcept;
  // With all that is pending; of a lane without a feature all zero.
  void get(int feature, FeatureEstimate& estimate) const noexcept;
  // Its coefficients alone (mm).
  void get(int feature, StateVector& x) const noexcept;

  // As diffuse(FeatureEstimate&): the variance of a random walk, taking effect at the next sweep.
  void diffuse(int feature, double deviation_mm) noexcept;

  void sweep(int group, const SweepPhases<Real>& phases) noexcept;

  // Position, velocity and covariance at phase k of the last sweep, whose phases these must be: hardly more than
  // reading them off.
  void motion(int group, const SweepPhases<Real>& phases, int k, LaneMotions<Real>& motions) noexcept;

  // P B^T at phase k < phases.learnt() of the last sweep, updates since then counted.
  void position_gain(int feature, const SweepPhases<Real>& phases, int k, PositionGain& M) noexcept;

  // Position and velocity at another phase, near phase k of the last sweep, whose covariance it takes.
  void motion_near(int group, const SweepPhases<Real>& phases, int k, const SweepPhase<Real>& at,
                   LaneMotions<Real>& motions) noexcept;

  // The same at any phase, by a pass over P that writes nothing.
  void motion_at(int group, const SweepPhase<Real>& phase, LaneMotions<Real>& motions) const noexcept;

  // Learns what was measured at phase k < phases.learnt() of the last sweep, whose phases these must be. Settings and
  // outcomes as of iterated_update. At most kMaxPendingUpdates times between two sweeps; beyond them nothing is
  // considered.
  template <class Model>
  void update(int group, const SweepPhases<Real>& phases, int k, const Pose& X_CW, const Model& model,
              const LaneObservations<Real>& observations, const UpdateSettings& settings,
              LaneOutcomes<Real>& outcomes) noexcept {
    UpdateTask<Real> task;
    task.other_model = {&model, &linearise_lanes<Model>};
    run(task, group, phases, k, X_CW, observations, settings, outcomes);
  }
  void update(int group, const SweepPhases<Real>& phases, int k, const Pose& X_CW, const PixelModel& model,
              const LaneObservations<Real>& observations, const UpdateSettings& settings,
              LaneOutcomes<Real>& outcomes) noexcept {
    // A fisheye's trigonometry goes lane by lane.
    if (model.camera.lens != Lens::kBrownConrady) {
      update<PixelModel>(group, phases, k, X_CW, model, observations, settings, outcomes);
      return;
    }
    const PinholeLens<Real> lens = pinhole_lens<Real>(model.camera);
    UpdateTask<Real> task;
    task.lens = &lens;
    run(task, group, phases, k, X_CW, observations, settings, outcomes);
  }

 private:
  struct alignas(64) Group {
    GroupView<Real> view;
    int pending = 0;
    std::array<int, kMaxSweepPhases> corrected{};  // how many of the pending updates S and M of a phase contain
    LaneMask occupied = 0;
    LaneMask swept = 0;                        // occupied, and S and M are theirs
    std::array<Real, kLanes> diffusion_mm2{};  // to be added at the next sweep, to the variance of the mean
  };
  struct Place {
    Group* group;
    int lane;
  };
  struct AlignedDelete {
    void operator()(Real* memory) const noexcept { ::operator delete[](memory, std::align_val_t{64}); }
  };

  template <class Model>
  static void linearise_lanes(const void* model, int lanes, const Real* wanted, const Real* z, const Real* q, Real* r,
                              Real* J, Real* status) noexcept {
    for (int l = 0; l < lanes; ++l) {
      if (wanted[l] == Real(0)) continue;
      const auto element = [l](const Real* elements, int i) { return double(elements[i * kLanes + l]); };
      Vector2d z_predicted;
      Matrix23d dz_dq;
      const auto& m = *static_cast<const Model*>(model);
      const ProjectionStatus result =
          m.predict(Vector3d(element(q, 0), element(q, 1), element(q, 2)), z_predicted, &dz_dq);
      status[l] = static_cast<Real>(static_cast<int>(status_of(result)));
      if (result != ProjectionStatus::kOk) continue;
      const Vector2d residual = m.residual(Vector2d(element(z, 0), element(z, 1)), z_predicted);
      for (int i = 0; i < 2; ++i) {
        r[i * kLanes + l] = static_cast<Real>(residual(i));
        for (int j = 0; j < 3; ++j) J[(3 * i + j) * kLanes + l] = static_cast<Real>(dz_dq(i, j));
      }
    }
  }

  [[nodiscard]] Place place(int feature) noexcept {
    return {&groups_[static_cast<std::size_t>(feature / kLanes)], feature % kLanes};
  }
  [[nodiscard]] std::size_t lower_element(int row, int column) const noexcept;
  void correct(Group& group, const SweepPhases<Real>& phases, int k) noexcept;
  void run(UpdateTask<Real>& task, int group, const SweepPhases<Real>& phases, int k, const Pose& X_CW,
           const LaneObservations<Real>& observations, const UpdateSettings& settings,
           LaneOutcomes<Real>& outcomes) noexcept;

  BasisLayout layout_;
  const SweepKernels<Real>& sweep_kernels_;
  const UpdateKernels<Real>& update_kernels_;
  std::vector<CovarianceTile> tiles_;
  std::vector<std::size_t> tile_of_row_;
  std::array<Real, kMaxBasis> diffusion_shape_{};  // variance of each coefficient of an axis for that of the mean
  std::unique_ptr<Real[], AlignedDelete> memory_;
  std::vector<Group> groups_;
};

extern template class FeatureBank<double>;
extern template class FeatureBank<float>;

}  // namespace perimap
