#include "core/bank/sweep_kernels.hpp"

#include <algorithm>
#include <utility>

#include "core/simd/target_choice.hpp"

#undef HWY_TARGET_INCLUDE
// Highway reads its name and compiles it once for each target.
#define HWY_TARGET_INCLUDE "core/bank/sweep_kernels.cpp"  // NOLINT(cppcoreguidelines-macro-usage)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace perimap::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class Real>
using Tag = hn::CappedTag<Real, kLanes>;
template <class Real>
using Vector = hn::Vec<Tag<Real>>;

// Where (row, column) of a symmetric 3x3 matrix stands, row >= column.
HWY_INLINE constexpr int lower_index(int row, int column) noexcept { return row * (row + 1) / 2 + column; }

template <class Visit, int... kIndices>
HWY_INLINE void unroll(std::integer_sequence<int, kIndices...>, const Visit& visit) noexcept {
  (visit(std::integral_constant<int, kIndices>()), ...);
}

// Calls visit(0) to visit(kCount - 1) with the number as a type. For nested loops, which the compiler would unroll too
// late to keep arrays of vectors in registers.
template <int kCount, class Visit>
HWY_INLINE void unroll(const Visit& visit) noexcept {
  unroll(std::make_integer_sequence<int, kCount>(), visit);
}

// Element i of an array of lane groups, from lane `lane` on.
template <class Real>
HWY_INLINE Real* at(Real* elements, int i, int lane) noexcept {
  return elements + i * kLanes + lane;
}

// What to do at a visit of a tile: the first of the pending updates, of the learnt phases with their M, and of the
// predicted phases with their S. How many of each are template parameters.
template <class Real>
struct TileWork {
  const Real* U = nullptr;
  const SweepPhase<Real>* learnt = nullptr;
  Real* gain = nullptr;
  const SweepPhase<Real>* predicted = nullptr;
  Real* S = nullptr;
};

// What stays the same during a visit of a tile: the rows' part of the pending updates and of the phases. Vectors live
// in small arrays here, which only fully unrolled loops keep in registers.
template <int kRows, int kPairs, int kLearnt, int kPredicted, class Real>
struct TileRows {
  // Arrays of length zero are not C++.
  static constexpr int kU = std::max(kPairs, 1);
  static constexpr int kL = std::max(kLearnt, 1);
  static constexpr int kQ = std::max(kPredicted, 1);

  // A store of a vector may change anything, as far as the compiler knows: what stays the same is kept outside.
  int n;
  int d;
  int a;    // the axis
  int i_0;  // the first row
  int k_0;  // its coefficient
  const Real* U[kU];
  Vector<Real> U_i[kU][kRows][2];
  const Real* b[kL];
  Real* M[kL];
  Vector<Real> b_i[kL][kRows];
  const Real* b_predicted[kQ];

  HWY_INLINE TileRows(const GroupView<Real>& group, const CovarianceTile& tile, const TileWork<Real>& work,
                      int lane) noexcept
      : n(group.n), d(group.d), a(tile.axis), i_0(tile.first_row), k_0(i_0 - a * n) {
    const Tag<Real> tag;
    for (int m = 0; m < kPairs; ++m) {
      U[m] = at(work.U, m * d * 2, lane);
      for (int r = 0; r < kRows; ++r) {
        U_i[m][r][0] = hn::Load(tag, U[m] + 2 * (i_0 + r) * kLanes);
        U_i[m][r][1] = hn::Load(tag, U[m] + (2 * (i_0 + r) + 1) * kLanes);
      }
    }
    for (int q = 0; q < kLearnt; ++q) {
      b[q] = work.learnt[q].b.data();
      M[q] = at(work.gain, q * 3 * d, lane);
      for (int r = 0; r < kRows; ++r) b_i[q][r] = hn::Set(tag, b[q][k_0 + r]);
    }
    for (int q = 0; q < kPredicted; ++q) b_predicted[q] = work.predicted[q].b.data();
  }
};

// What the columns of one axis add up to, row by row.
template <int kRows, int kLearnt, int kPredicted, class Real>
struct RowSums {
  Vector<Real> M_i[std::max(kLearnt, 1)][kRows];
  Vector<Real> Pb_i[std::max(kPredicted, 1)][kRows];

  HWY_INLINE RowSums() noexcept {
    const Tag<Real> tag;
    for (int q = 0; q < kLearnt; ++q) {
      for (int r = 0; r < kRows; ++r) M_i[q][r] = hn::Zero(tag);
    }
    for (int q = 0; q < kPredicted; ++q) {
      for (int r = 0; r < kRows; ++r) Pb_i[q][r] = hn::Zero(tag);
    }
  }
};

// The first `columns` columns of axis c, all of them left of the diagonal.
template <int kRows, int kPairs, int kLearnt, int kPredicted, class Real>
HWY_INLINE void visit_columns(const TileRows<kRows, kPairs, kLearnt, kPredicted, Real>& rows, int c, int columns,
                              Real*& P, RowSums<kRows, kLearnt, kPredicted, Real>& sums) noexcept {
  using V = Vector<Real>;
  using Rows = TileRows<kRows, kPairs, kLearnt, kPredicted, Real>;
  const Tag<Real> tag;
  const Real* U_column[Rows::kU];
  for (int m = 0; m < kPairs; ++m) U_column[m] = rows.U[m] + 2 * c * rows.n * kLanes;
  Real* M_column[Rows::kL];
  for (int q = 0; q < kLearnt; ++q) M_column[q] = rows.M[q] + (rows.a * rows.d + c * rows.n) * kLanes;
  for (int k = 0; k < columns; ++k) {
    V U_j[Rows::kU][2];
    for (int m = 0; m < kPairs; ++m) {
      U_j[m][0] = hn::Load(tag, U_column[m]);
      U_j[m][1] = hn::Load(tag, U_column[m] + kLanes);
      U_column[m] += 2 * kLanes;
    }
    V M_j[Rows::kL];
    for (int q = 0; q < kLearnt; ++q) M_j[q] = hn::Load(tag, M_column[q]);
    V b_k[Rows::kL];
    for (int q = 0; q < kLearnt; ++q) b_k[q] = hn::Set(tag, rows.b[q][k]);
    V b_predicted_k[Rows::kQ];
    for (int q = 0; q < kPredicted; ++q) b_predicted_k[q] = hn::Set(tag, rows.b_predicted[q][k]);
    for (int r = 0; r < kRows; ++r) {
      V p = hn::Load(tag, P + r * kLanes);
      for (int m = 0; m < kPairs; ++m) {
        p = hn::NegMulAdd(rows.U_i[m][r][0], U_j[m][0], p);
        p = hn::NegMulAdd(rows.U_i[m][r][1], U_j[m][1], p);
      }
      if constexpr (kPairs > 0) hn::Store(p, tag, P + r * kLanes);
      for (int q = 0; q < kLearnt; ++q) {
        sums.M_i[q][r] = hn::MulAdd(p, b_k[q], sums.M_i[q][r]);
        M_j[q] = hn::MulAdd(p, rows.b_i[q][r], M_j[q]);
      }
      for (int q = 0; q < kPredicted; ++q) sums.Pb_i[q][r] = hn::MulAdd(p, b_predicted_k[q], sums.Pb_i[q][r]);
    }
    for (int q = 0; q < kLearnt; ++q) {
      hn::Store(M_j[q], tag, M_column[q]);
      M_column[q] += kLanes;
    }
    P += kRows * kLanes;
  }
}

// The block on the diagonal: left of it element by element, then the diagonal itself.
template <int kRows, int kPairs, int kLearnt, int kPredicted, class Real>
HWY_INLINE void visit_corner(const GroupView<Real>& group,
                             const TileRows<kRows, kPairs, kLearnt, kPredicted, Real>& rows, int lane, Real*& P,
                             RowSums<kRows, kLearnt, kPredicted, Real>& sums) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  unroll<kRows>([&](auto r) HWY_ATTR {
    unroll<r>([&](auto s) HWY_ATTR {
      V p = hn::Load(tag, P);
      for (int m = 0; m < kPairs; ++m) {
        p = hn::NegMulAdd(rows.U_i[m][r][0], rows.U_i[m][s][0], p);
        p = hn::NegMulAdd(rows.U_i[m][r][1], rows.U_i[m][s][1], p);
      }
      if constexpr (kPairs > 0) hn::Store(p, tag, P);
      P += kLanes;
      for (int q = 0; q < kLearnt; ++q) {
        sums.M_i[q][r] = hn::MulAdd(p, rows.b_i[q][s], sums.M_i[q][r]);
        sums.M_i[q][s] = hn::MulAdd(p, rows.b_i[q][r], sums.M_i[q][s]);
      }
      for (int q = 0; q < kPredicted; ++q) {
        sums.Pb_i[q][r] = hn::MulAdd(p, hn::Set(tag, rows.b_predicted[q][rows.k_0 + s]), sums.Pb_i[q][r]);
      }
    });
  });
  for (int r = 0; r < kRows; ++r) {
    const V p = hn::Load(tag, at(group.diagonal, rows.i_0 + r, lane));
    for (int q = 0; q < kLearnt; ++q) sums.M_i[q][r] = hn::MulAdd(p, rows.b_i[q][r], sums.M_i[q][r]);
    // Half: the block on the diagonal is doubled where the rows are summed.
    for (int q = 0; q < kPredicted; ++q) {
      const V half = hn::Set(tag, Real(0.5) * rows.b_predicted[q][rows.k_0 + r]);
      sums.Pb_i[q][r] = hn::MulAdd(p, half, sums.Pb_i[q][r]);
    }
  }
}

// Applies kPairs pending updates, then adds the tile's part to M and to S.
//
// An element P_ij left of the diagonal counts twice, as P_ij and as P_ji: M gets P_ij b_j in row i and P_ij b_i in row
// j. Row i of M is set here; to row j is added, which its own tile, an earlier one, has set.
template <int kRows, int kPairs, int kLearnt, int kPredicted, class Real>
HWY_INLINE void visit_tile(const GroupView<Real>& group, const CovarianceTile& tile, const TileWork<Real>& work,
                           int lane) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const TileRows<kRows, kPairs, kLearnt, kPredicted, Real> rows(group, tile, work, lane);
  const int a = rows.a;
  Real* P = at(group.lower, static_cast<int>(tile.offset), lane);
  for (int c = 0; c <= a; ++c) {
    RowSums<kRows, kLearnt, kPredicted, Real> sums;
    visit_columns(rows, c, c < a ? rows.n : rows.k_0, P, sums);
    if (c == a) visit_corner(group, rows, lane, P, sums);
    for (int q = 0; q < kLearnt; ++q) {
      for (int r = 0; r < kRows; ++r) {
        hn::Store(sums.M_i[q][r], tag, rows.M[q] + (c * rows.d + rows.i_0 + r) * kLanes);
      }
    }
    for (int q = 0; q < kPredicted; ++q) {
      V sum = hn::Zero(tag);
      for (int r = 0; r < kRows; ++r) {
        sum = hn::MulAdd(sums.Pb_i[q][r], hn::Set(tag, rows.b_predicted[q][rows.k_0 + r]), sum);
      }
      if (c == a) sum = hn::Add(sum, sum);
      Real* S = at(work.S, q * 6 + lower_index(a, c), lane);
      hn::Store(hn::Add(hn::Load(tag, S), sum), tag, S);
    }
  }
  for (int q = 0; q < kLearnt; ++q) {
    for (int c = a + 1; c < 3; ++c) {
      for (int r = 0; r < kRows; ++r) {
        hn::Store(hn::Zero(tag), tag, rows.M[q] + (c * rows.d + rows.i_0 + r) * kLanes);
      }
    }
  }
}

template <int kPairs, int kLearnt, int kPredicted, class Real>
HWY_NOINLINE void visit(const GroupView<Real>& group, const CovarianceTile& tile, const TileWork<Real>& work) noexcept {
  for (int lane = 0; lane < kLanes; lane += static_cast<int>(hn::Lanes(Tag<Real>()))) {
    if (tile.rows == 4) {
      visit_tile<4, kPairs, kLearnt, kPredicted>(group, tile, work, lane);
    } else if (tile.rows == 3) {
      visit_tile<3, kPairs, kLearnt, kPredicted>(group, tile, work, lane);
    } else {
      visit_tile<1, kPairs, kLearnt, kPredicted>(group, tile, work, lane);
    }
  }
}

// S = B M of a learnt phase.
template <class Real>
void contract_gain(const GroupView<Real>& group, const SweepPhase<Real>& phase, const Real* gain, Real* S) noexcept {
  const Tag<Real> tag;
  for (int lane = 0; lane < kLanes; lane += static_cast<int>(hn::Lanes(tag))) {
    for (int a = 0; a < 3; ++a) {
      for (int c = 0; c <= a; ++c) {
        Vector<Real> even = hn::Zero(tag);
        Vector<Real> odd = hn::Zero(tag);
        const Real* M = at(gain, c * group.d + a * group.n, lane);
        const Real* b = phase.b.data();
        int k = 0;
        for (; k + 1 < group.n; k += 2) {
          even = hn::MulAdd(hn::Load(tag, M + k * kLanes), hn::Set(tag, b[k]), even);
          odd = hn::MulAdd(hn::Load(tag, M + (k + 1) * kLanes), hn::Set(tag, b[k + 1]), odd);
        }
        if (k < group.n) even = hn::MulAdd(hn::Load(tag, M + k * kLanes), hn::Set(tag, b[k]), even);
        hn::Store(hn::Add(even, odd), tag, at(S, lower_index(a, c), lane));
      }
    }
  }
}

template <class Real>
void set_zero(Real* elements, int count) noexcept {
  const Tag<Real> tag;
  for (int i = 0; i < count * kLanes; i += static_cast<int>(hn::Lanes(tag))) {
    hn::Store(hn::Zero(tag), tag, elements + i);
  }
}

// A tile is small enough to stay in the first-level cache, so it is visited as often as it takes, and P as a whole is
// still read once. The first visit does what a frame usually needs: the last pending update, one phase to learn at, two
// to predict at.
template <class Real>
void sweep_tile(const GroupView<Real>& group, const CovarianceTile& tile, const SweepPhases<Real>& phases,
                int pending) noexcept {
  int updates = pending;
  int learnt = phases.learnt();
  int predicted = phases.count() - learnt;
  TileWork<Real> work{group.pending, &phases[0], group.gains, &phases[learnt], group.S + learnt * 6 * kLanes};
  const auto next_updates = [&](int count) noexcept { work.U += count * 2 * group.d * kLanes; };
  const auto next_learnt = [&](int count) noexcept {
    work.learnt += count;
    work.gain += count * 3 * group.d * kLanes;
  };
  const auto next_predicted = [&](int count) noexcept {
    work.predicted += count;
    work.S += count * 6 * kLanes;
  };
  for (; updates > 2; updates -= 2) {
    visit<2, 0, 0>(group, tile, work);
    next_updates(2);
  }
  for (; updates > 1; --updates) {
    visit<1, 0, 0>(group, tile, work);
    next_updates(1);
  }
  if (updates > 0) {
    if (learnt > 0 && predicted > 1) {
      visit<1, 1, 2>(group, tile, work);
      next_learnt(1);
      next_predicted(2);
      --learnt;
      predicted -= 2;
    } else if (learnt > 0) {
      visit<1, 1, 0>(group, tile, work);
      next_learnt(1);
      --learnt;
    } else {
      visit<1, 0, 0>(group, tile, work);
    }
  }
  for (; learnt > 1; learnt -= 2) {
    visit<0, 2, 0>(group, tile, work);
    next_learnt(2);
  }
  if (learnt > 0) visit<0, 1, 0>(group, tile, work);
  for (; predicted > 1; predicted -= 2) {
    visit<0, 0, 2>(group, tile, work);
    next_predicted(2);
  }
  if (predicted > 0) visit<0, 0, 1>(group, tile, work);
}

template <class Real>
void sweep(const GroupView<Real>& group, const SweepPhases<Real>& phases, int pending) noexcept {
  const int learnt = phases.learnt();
  set_zero(group.S + learnt * 6 * kLanes, 6 * (phases.count() - learnt));
  for (int t = 0; t < group.tile_count; ++t) sweep_tile(group, group.tiles[t], phases, pending);
  for (int k = 0; k < learnt; ++k) {
    contract_gain(group, phases[k], group.gains + k * 3 * group.d * kLanes, group.S + k * 6 * kLanes);
  }
}

// S <- S - (B U)(B U)^T, M <- M - U (B U)^T.
template <class Real>
void correct(const GroupView<Real>& group, const SweepPhase<Real>& phase, const Real* U, Real* S, Real* gain) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  for (int lane = 0; lane < kLanes; lane += static_cast<int>(hn::Lanes(tag))) {
    V BU[3][2];
    for (int a = 0; a < 3; ++a) {
      V sum_0 = hn::Zero(tag);
      V sum_1 = hn::Zero(tag);
      for (int k = 0; k < group.n; ++k) {
        const V b = hn::Set(tag, phase.b[static_cast<std::size_t>(k)]);
        sum_0 = hn::MulAdd(hn::Load(tag, at(U, 2 * (a * group.n + k), lane)), b, sum_0);
        sum_1 = hn::MulAdd(hn::Load(tag, at(U, 2 * (a * group.n + k) + 1, lane)), b, sum_1);
      }
      BU[a][0] = sum_0;
      BU[a][1] = sum_1;
    }
    for (int a = 0; a < 3; ++a) {
      for (int c = 0; c <= a; ++c) {
        Real* entry = at(S, lower_index(a, c), lane);
        V s = hn::Load(tag, entry);
        s = hn::NegMulAdd(BU[a][0], BU[c][0], s);
        hn::Store(hn::NegMulAdd(BU[a][1], BU[c][1], s), tag, entry);
      }
    }
    if (gain == nullptr) continue;
    for (int i = 0; i < group.d; ++i) {
      const V U_0 = hn::Load(tag, at(U, 2 * i, lane));
      const V U_1 = hn::Load(tag, at(U, 2 * i + 1, lane));
      for (int c = 0; c < 3; ++c) {
        Real* entry = at(gain, c * group.d + i, lane);
        V m = hn::Load(tag, entry);
        m = hn::NegMulAdd(U_0, BU[c][0], m);
        hn::Store(hn::NegMulAdd(U_1, BU[c][1], m), tag, entry);
      }
    }
  }
}

// Adds to S what a pending update has already taken from the diagonal of P, so that the whole of it can be subtracted.
template <class Real>
void restore_diagonal(const GroupView<Real>& group, const SweepPhase<Real>& phase, const Real* U, Real* S) noexcept {
  const Tag<Real> tag;
  for (int lane = 0; lane < kLanes; lane += static_cast<int>(hn::Lanes(tag))) {
    for (int a = 0; a < 3; ++a) {
      Vector<Real> sum = hn::Load(tag, at(S, lower_index(a, a), lane));
      for (int k = 0; k < group.n; ++k) {
        const Vector<Real> b = hn::Set(tag, phase.b[static_cast<std::size_t>(k)]);
        const Vector<Real> weighted_0 = hn::Mul(b, hn::Load(tag, at(U, 2 * (a * group.n + k), lane)));
        const Vector<Real> weighted_1 = hn::Mul(b, hn::Load(tag, at(U, 2 * (a * group.n + k) + 1, lane)));
        sum = hn::MulAdd(weighted_1, weighted_1, hn::MulAdd(weighted_0, weighted_0, sum));
      }
      hn::Store(sum, tag, at(S, lower_index(a, a), lane));
    }
  }
}

template <class Real>
void position_covariance(const GroupView<Real>& group, const SweepPhase<Real>& phase, int pending, Real* S) noexcept {
  set_zero(S, 6);
  const TileWork<Real> work{nullptr, nullptr, nullptr, &phase, S};
  for (int t = 0; t < group.tile_count; ++t) visit<0, 0, 1>(group, group.tiles[t], work);
  for (int m = 0; m < pending; ++m) {
    const Real* U = group.pending + m * 2 * group.d * kLanes;
    restore_diagonal(group, phase, U, S);
    correct<Real>(group, phase, U, S, nullptr);
  }
}

template <class Real>
void motion(const GroupView<Real>& group, const SweepPhase<Real>& phase, const Real* S,
            LaneMotions<Real>& motions) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  for (int lane = 0; lane < kLanes; lane += static_cast<int>(hn::Lanes(tag))) {
    V spread[3];  // what one standard deviation of the phase moves the feature by
    for (int a = 0; a < 3; ++a) {
      V position = hn::Zero(tag);
      V rate = hn::Zero(tag);
      for (int k = 0; k < group.n; ++k) {
        const V x = hn::Load(tag, at(group.x, a * group.n + k, lane));
        position = hn::MulAdd(x, hn::Set(tag, phase.b[static_cast<std::size_t>(k)]), position);
        rate = hn::MulAdd(x, hn::Set(tag, phase.b_rate[static_cast<std::size_t>(k)]), rate);
      }
      const V velocity = hn::Mul(rate, hn::Set(tag, phase.rate_rad_per_s));
      spread[a] = hn::Mul(velocity, hn::Set(tag, phase.deviation_s));
      hn::StoreU(position, tag, motions.position[a] + lane);
      hn::StoreU(velocity, tag, motions.velocity[a] + lane);
      for (int c = 0; c <= a; ++c) {
        const V s = hn::Load(tag, at(S, lower_index(a, c), lane));
        hn::StoreU(hn::MulAdd(spread[a], spread[c], s), tag, motions.covariance[lower_index(a, c)] + lane);
      }
    }
  }
}

const SweepKernels<double>* sweep_table_double() {
  static constexpr SweepKernels<double> kTable{&sweep<double>, &position_covariance<double>, &correct<double>,
                                               &motion<double>};
  return &kTable;
}

const SweepKernels<float>* sweep_table_float() {
  static constexpr SweepKernels<float> kTable{&sweep<float>, &position_covariance<float>, &correct<float>,
                                              &motion<float>};
  return &kTable;
}

}  // namespace perimap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace perimap {

HWY_EXPORT(sweep_table_double);
HWY_EXPORT(sweep_table_float);

template <>
const SweepKernels<double>& sweep_kernels(SimdTarget target) {
  return *with_target(target, [] { return HWY_DYNAMIC_DISPATCH(sweep_table_double)(); });
}

template <>
const SweepKernels<float>& sweep_kernels(SimdTarget target) {
  return *with_target(target, [] { return HWY_DYNAMIC_DISPATCH(sweep_table_float)(); });
}

}  // namespace perimap
#endif
