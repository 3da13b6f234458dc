#include "core/bank/feature_bank.hpp"

#include <algorithm>

namespace perimap {
namespace {

template <class Real>
Real& lane_of(Real* elements, std::size_t i, int lane) noexcept {
  return elements[i * kLanes + static_cast<std::size_t>(lane)];
}

std::vector<CovarianceTile> covariance_tiles(int n) {
  std::vector<CovarianceTile> tiles;
  std::size_t offset = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < n;) {
      // n is odd, so three or one remain.
      const int rows = n - k >= 4 ? 4 : n - k;
      const int first_row = axis * n + k;
      tiles.push_back({first_row, rows, axis, offset});
      offset += static_cast<std::size_t>(first_row * rows + rows * (rows - 1) / 2);
      k += rows;
    }
  }
  return tiles;
}

}  // namespace

template <class Real>
FeatureBank<Real>::FeatureBank(const BankSettings& settings)
    : layout_(settings.layout),
      sweep_kernels_(sweep_kernels<Real>(settings.target)),
      update_kernels_(update_kernels<Real>(settings.target)),
      tiles_(covariance_tiles(layout_.size())),
      groups_(static_cast<std::size_t>((settings.features + kLanes - 1) / kLanes)) {
  const int d = layout_.state_size();
  tile_of_row_.resize(static_cast<std::size_t>(d));
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    for (int r = 0; r < tiles_[t].rows; ++r) tile_of_row_[static_cast<std::size_t>(tiles_[t].first_row + r)] = t;
  }
  const Basis shape = diffusion_shape(layout_);
  for (Eigen::Index i = 0; i < shape.size(); ++i) {
    diffusion_shape_[static_cast<std::size_t>(i)] = static_cast<Real>(shape(i));
  }

  const auto size = static_cast<std::size_t>(d);
  const std::size_t parts[] = {size,                           // x
                               size,                           // diagonal
                               size * (size - 1) / 2,          // lower
                               kMaxPendingUpdates * size * 2,  // pending
                               kMaxLearntPhases * size * 3,    // gains
                               kMaxSweepPhases * 6};           // S
  std::size_t elements = 0;
  for (const std::size_t part : parts) elements += part;
  // A distance between groups of a multiple of 4 KiB would have their parts compete for the same sets of the cache.
  if (elements * kLanes * sizeof(Real) % 4096 == 0) ++elements;
  const std::size_t reals = elements * kLanes * groups_.size();
  memory_.reset(new (std::align_val_t{64}) Real[reals]());
  Real* next = memory_.get();
  for (Group& group : groups_) {
    GroupView<Real>& view = group.view;
    view.n = layout_.size();
    view.d = d;
    view.tiles = tiles_.data();
    view.tile_count = static_cast<int>(tiles_.size());
    Real* part = next;
    std::size_t i = 0;
    for (Real** pointer : {&view.x, &view.diagonal, &view.lower, &view.pending, &view.gains, &view.S}) {
      *pointer = part;
      part += parts[i++] * kLanes;
    }
    next += elements * kLanes;
  }
}

template <class Real>
std::size_t FeatureBank<Real>::lower_element(int row, int column) const noexcept {
  const CovarianceTile& tile = tiles_[tile_of_row_[static_cast<std::size_t>(row)]];
  const int r = row - tile.first_row;
  const int s = column - tile.first_row;
  const int element = s < 0 ? column * tile.rows + r : tile.first_row * tile.rows + r * (r - 1) / 2 + s;
  return tile.offset + static_cast<std::size_t>(element);
}

template <class Real>
void FeatureBank<Real>::set(int feature, const FeatureEstimate& estimate) noexcept {
  clear(feature);
  const auto [group, lane] = place(feature);
  const GroupView<Real>& view = group->view;
  for (int i = 0; i < view.d; ++i) {
    const auto element = static_cast<std::size_t>(i);
    lane_of(view.x, element, lane) = static_cast<Real>(estimate.x(i));
    lane_of(view.diagonal, element, lane) = static_cast<Real>(estimate.P(i, i));
    for (int j = 0; j < i; ++j) {
      lane_of(view.lower, lower_element(i, j), lane) = static_cast<Real>(estimate.P(i, j));
    }
  }
  group->occupied = static_cast<LaneMask>(group->occupied | 1U << lane);
}

template <class Real>
void FeatureBank<Real>::clear(int feature) noexcept {
  const auto [group, lane] = place(feature);
  const GroupView<Real>& view = group->view;
  const auto d = static_cast<std::size_t>(view.d);
  for (std::size_t i = 0; i < d; ++i) lane_of(view.x, i, lane) = lane_of(view.diagonal, i, lane) = Real(0);
  for (std::size_t i = 0; i < d * (d - 1) / 2; ++i) lane_of(view.lower, i, lane) = Real(0);
  for (std::size_t i = 0; i < kMaxPendingUpdates * d * 2; ++i) lane_of(view.pending, i, lane) = Real(0);
  group->diffusion_mm2[static_cast<std::size_t>(lane)] = Real(0);
  const auto others = static_cast<LaneMask>(~(1U << lane));
  group->occupied = group->occupied & others;
  group->swept = group->swept & others;
}

template <class Real>
bool FeatureBank<Real>::occupied(int feature) const noexcept {
  return (groups_[static_cast<std::size_t>(feature / kLanes)].occupied >> feature % kLanes & 1) != 0;
}

template <class Real>
void FeatureBank<Real>::get(int feature, FeatureEstimate& estimate) const noexcept {
  const Group& group = groups_[static_cast<std::size_t>(feature / kLanes)];
  const GroupView<Real>& view = group.view;
  const int lane = feature % kLanes;
  estimate.x.resize(view.d);
  estimate.P.resize(view.d, view.d);
  const double diffusion_mm2 = double(group.diffusion_mm2[static_cast<std::size_t>(lane)]);
  for (int i = 0; i < view.d; ++i) {
    const auto row = static_cast<std::size_t>(i);
    estimate.x(i) = double(lane_of(view.x, row, lane));
    estimate.P(i, i) = double(lane_of(view.diagonal, row, lane)) +
                       diffusion_mm2 * double(diffusion_shape_[static_cast<std::size_t>(i % view.n)]);
    for (int j = 0; j < i; ++j) {
      double p = double(lane_of(view.lower, lower_element(i, j), lane));
      for (int m = 0; m < group.pending; ++m) {
        for (int c = 0; c < 2; ++c) {
          const auto U = [&](int k) {
            return double(lane_of(view.pending, static_cast<std::size_t>((m * view.d + k) * 2 + c), lane));
          };
          p -= U(i) * U(j);
        }
      }
      estimate.P(i, j) = estimate.P(j, i) = p;
    }
  }
}

template <class Real>
void FeatureBank<Real>::get(int feature, StateVector& x) const noexcept {
  const GroupView<Real>& view = groups_[static_cast<std::size_t>(feature / kLanes)].view;
  x.resize(view.d);
  for (int i = 0; i < view.d; ++i) x(i) = double(lane_of(view.x, static_cast<std::size_t>(i), feature % kLanes));
}

template <class Real>
void FeatureBank<Real>::diffuse(int feature, double deviation_mm) noexcept {
  const auto [group, lane] = place(feature);
  if ((group->occupied >> lane & 1) == 0) return;
  group->diffusion_mm2[static_cast<std::size_t>(lane)] += static_cast<Real>(deviation_mm * deviation_mm);
}

template <class Real>
void FeatureBank<Real>::sweep(int group_index, const SweepPhases<Real>& phases) noexcept {
  Group& group = groups_[static_cast<std::size_t>(group_index)];
  const GroupView<Real>& view = group.view;
  if (std::any_of(group.diffusion_mm2.begin(), group.diffusion_mm2.end(), [](Real v) { return v != Real(0); })) {
    for (int i = 0; i < view.d; ++i) {
      const Real shape = diffusion_shape_[static_cast<std::size_t>(i % view.n)];
      for (int lane = 0; lane < kLanes; ++lane) {
        lane_of(view.diagonal, static_cast<std::size_t>(i), lane) +=
            group.diffusion_mm2[static_cast<std::size_t>(lane)] * shape;
      }
    }
    group.diffusion_mm2.fill(Real(0));
  }
  sweep_kernels_.sweep(view, phases, group.pending);
  group.pending = 0;
  group.corrected.fill(0);
  group.swept = group.occupied;
}

template <class Real>
void FeatureBank<Real>::correct(Group& group, const SweepPhases<Real>& phases, int k) noexcept {
  const GroupView<Real>& view = group.view;
  Real* gain = k < phases.learnt() ? view.gains + k * 3 * view.d * kLanes : nullptr;
  int& corrected = group.corrected[static_cast<std::size_t>(k)];
  for (; corrected < group.pending; ++corrected) {
    sweep_kernels_.correct(view, phases[k], view.pending + corrected * 2 * view.d * kLanes, view.S + k * 6 * kLanes,
                           gain);
  }
}

template <class Real>
void FeatureBank<Real>::motion(int group, const SweepPhases<Real>& phases, int k, LaneMotions<Real>& motions) noexcept {
  motion_near(group, phases, k, phases[k], motions);
}

template <class Real>
void FeatureBank<Real>::position_gain(int feature, const SweepPhases<Real>& phases, int k, PositionGain& M) noexcept {
  const auto [group, lane] = place(feature);
  correct(*group, phases, k);
  const int d = group->view.d;
  M.resize(d, 3);
  for (int i = 0; i < 3 * d; ++i) {
    M(i % d, i / d) = double(lane_of(group->view.gains, static_cast<std::size_t>(k * 3 * d + i), lane));
  }
}

template <class Real>
void FeatureBank<Real>::motion_near(int group_index, const SweepPhases<Real>& phases, int k, const SweepPhase<Real>& at,
                                    LaneMotions<Real>& motions) noexcept {
  Group& group = groups_[static_cast<std::size_t>(group_index)];
  correct(group, phases, k);
  sweep_kernels_.motion(group.view, at, group.view.S + k * 6 * kLanes, motions);
  motions.valid = group.swept;
}

template <class Real>
void FeatureBank<Real>::motion_at(int group_index, const SweepPhase<Real>& phase,
                                  LaneMotions<Real>& motions) const noexcept {
  const Group& group = groups_[static_cast<std::size_t>(group_index)];
  alignas(64) Real S[6 * kLanes];
  sweep_kernels_.position_covariance(group.view, phase, group.pending, S);
  sweep_kernels_.motion(group.view, phase, S, motions);
  motions.valid = group.occupied;
}

template <class Real>
void FeatureBank<Real>::run(UpdateTask<Real>& task, int group_index, const SweepPhases<Real>& phases, int k,
                            const Pose& X_CW, const LaneObservations<Real>& observations,
                            const UpdateSettings& settings, LaneOutcomes<Real>& outcomes) noexcept {
  Group& group = groups_[static_cast<std::size_t>(group_index)];
  const GroupView<Real>& view = group.view;
  outcomes.considered = outcomes.accepted = 0;
  task.considered = group.swept & observations.measured;
  if (task.considered == 0 || group.pending == kMaxPendingUpdates || k < 0 || k >= phases.learnt()) return;
  correct(group, phases, k);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) task.R_CW[3 * i + j] = static_cast<Real>(X_CW.R(i, j));
    task.t_CW[i] = static_cast<Real>(X_CW.t(i));
  }
  task.phase = &phases[k];
  task.observations = &observations;
  task.settings = settings;
  task.S = view.S + k * 6 * kLanes;
  task.gain = view.gains + k * 3 * view.d * kLanes;
  task.U = view.pending + group.pending * 2 * view.d * kLanes;
  update_kernels_.update(view, task, outcomes);
  if (outcomes.accepted != 0) ++group.pending;
}

template class FeatureBank<double>;
template class FeatureBank<float>;

}  // namespace perimap
