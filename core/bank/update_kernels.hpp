// The update of one group in position space, compiled for several instruction sets.
#pragma once

#include "core/bank/group_view.hpp"
#include "core/bank/lanes.hpp"
#include "core/bank/pinhole_lens.hpp"
#include "core/bank/sweep_phases.hpp"
#include "core/simd/simd_target.hpp"

namespace perimap {

// Another measurement model, lane by lane: residuals z - h(q) and dh/dq at the points q (frame C), with the status of
// each as a number. Arrays [component][kLanes]; only the first `lanes` lanes are there, and only those with wanted != 0
// matter.
template <class Real>
struct LaneModel {
  const void* model = nullptr;
  void (*linearise)(const void* model, int lanes, const Real* wanted, const Real* z, const Real* q, Real* r, Real* J,
                    Real* status) noexcept = nullptr;
};

template <class Real>
struct UpdateTask {
  const SweepPhase<Real>* phase = nullptr;
  const LaneObservations<Real>* observations = nullptr;
  LaneMask considered = 0;
  Real R_CW[9]{};  // row by row
  Real t_CW[3]{};
  const PinholeLens<Real>* lens = nullptr;  // null: other_model
  LaneModel<Real> other_model;
  UpdateSettings settings;
  const Real* S = nullptr;
  const Real* gain = nullptr;
  Real* U = nullptr;  // [d][2], written in all lanes, zero where nothing is learnt
};

template <class Real>
struct UpdateKernels {
  // Changes x and the diagonal, and fills U, in the lanes that it accepts.
  void (*update)(const GroupView<Real>& group, const UpdateTask<Real>& task, LaneOutcomes<Real>& outcomes) noexcept;
};

template <class Real>
[[nodiscard]] const UpdateKernels<Real>& update_kernels(SimdTarget target);

}  // namespace perimap
