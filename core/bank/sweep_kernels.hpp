// The passes over the covariance of one group, compiled for several instruction sets.
#pragma once

#include "core/bank/group_view.hpp"
#include "core/bank/lanes.hpp"
#include "core/bank/sweep_phases.hpp"
#include "core/simd/simd_target.hpp"

namespace perimap {

template <class Real>
struct SweepKernels {
  // Applies the first `pending` updates to P and forms M of the learnt phases and S of all.
  void (*sweep)(const GroupView<Real>& group, const SweepPhases<Real>& phases, int pending) noexcept;
  // S of one phase without applying anything: corrected for the first `pending` updates. Reads only.
  void (*position_covariance)(const GroupView<Real>& group, const SweepPhase<Real>& phase, int pending,
                              Real* S) noexcept;
  // S, and M when gain is not null, after one more update U.
  void (*correct)(const GroupView<Real>& group, const SweepPhase<Real>& phase, const Real* U, Real* S,
                  Real* gain) noexcept;
  // Position, velocity and covariance; the phase's deviation widens the covariance along the velocity.
  void (*motion)(const GroupView<Real>& group, const SweepPhase<Real>& phase, const Real* S,
                 LaneMotions<Real>& motions) noexcept;
};

template <class Real>
[[nodiscard]] const SweepKernels<Real>& sweep_kernels(SimdTarget target);

}  // namespace perimap
