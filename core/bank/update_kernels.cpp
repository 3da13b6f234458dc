#include "core/bank/update_kernels.hpp"

#include "core/simd/target_choice.hpp"

#undef HWY_TARGET_INCLUDE
// Highway reads its name and compiles it once for each target.
#define HWY_TARGET_INCLUDE "core/bank/update_kernels.cpp"  // NOLINT(cppcoreguidelines-macro-usage)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// The steps and their reasons are those of core/estimation/iterated_update.cpp, with a lane mask in place of each
// branch. Lanes that are done or refused keep computing; what they compute is dropped.
HWY_BEFORE_NAMESPACE();
namespace perimap::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class Real>
using Tag = hn::CappedTag<Real, kLanes>;
template <class Real>
using Vector = hn::Vec<Tag<Real>>;
template <class Real>
using Mask = hn::Mask<Tag<Real>>;

template <class Real>
HWY_INLINE Real* at(Real* elements, int i, int lane) noexcept {
  return elements + i * kLanes + lane;
}

// Nearer than this a point counts as behind the camera (mm), as in CameraModel.
template <class Real>
constexpr Real kMinDepth = Real(1e-3);

// Relative rise of the cost that rounding alone may cause near the minimum. In single precision that of a residual of
// half a pixel with coordinates of a thousand.
template <class Real>
constexpr Real kCostSlack = sizeof(Real) == sizeof(double) ? Real(1e-9) : Real(1e-3);

template <class Real>
HWY_INLINE Vector<Real> number(UpdateStatus status) noexcept {
  return hn::Set(Tag<Real>(), static_cast<Real>(static_cast<int>(status)));
}

// a b - c d; where there is a fused multiply-add, to an error of about one rounding even when the products cancel
// (Kahan; Jeannerod, Louvet & Muller 2013).
template <class V>
HWY_INLINE V difference_of_products(V a, V b, V c, V d) noexcept {
  const V cd = hn::Mul(c, d);
  return hn::Add(hn::MulSub(a, b, cd), hn::NegMulAdd(c, d, cd));
}

template <class V>
HWY_INLINE V dot3(const V* a, const V* b) noexcept {
  return hn::MulAdd(a[2], b[2], hn::MulAdd(a[1], b[1], hn::Mul(a[0], b[0])));
}

// S v, with S as its lower triangle by rows.
template <class V>
HWY_INLINE void times_symmetric(const V* S, const V* v, V* product) noexcept {
  product[0] = hn::MulAdd(S[3], v[2], hn::MulAdd(S[1], v[1], hn::Mul(S[0], v[0])));
  product[1] = hn::MulAdd(S[4], v[2], hn::MulAdd(S[2], v[1], hn::Mul(S[1], v[0])));
  product[2] = hn::MulAdd(S[5], v[2], hn::MulAdd(S[4], v[1], hn::Mul(S[3], v[0])));
}

// L^-1 of a symmetric 2x2 matrix A = L L^T, as 1/l_00, l_10, 1/l_11.
template <class Real>
struct Whitening {
  Vector<Real> w_00, l_10, w_11;

  // The lanes where A is positive definite and finite.
  HWY_INLINE Mask<Real> factor(Vector<Real> a_00, Vector<Real> a_10, Vector<Real> a_11) noexcept {
    const Tag<Real> tag;
    const Vector<Real> one = hn::Set(tag, Real(1));
    w_00 = hn::Div(one, hn::Sqrt(a_00));
    l_10 = hn::Mul(a_10, w_00);
    const Vector<Real> rest = hn::NegMulAdd(l_10, l_10, a_11);
    w_11 = hn::Div(one, hn::Sqrt(rest));
    const Mask<Real> positive = hn::And(hn::Gt(a_00, hn::Zero(tag)), hn::Gt(rest, hn::Zero(tag)));
    return hn::And(positive, hn::And(hn::IsFinite(a_00), hn::IsFinite(rest)));
  }
  HWY_INLINE void apply(Vector<Real> v_0, Vector<Real> v_1, Vector<Real>& w_0, Vector<Real>& w_1) const noexcept {
    w_0 = hn::Mul(v_0, w_00);
    w_1 = hn::Mul(hn::NegMulAdd(l_10, w_0, v_1), w_11);
  }
  HWY_INLINE Vector<Real> squared_length(Vector<Real> v_0, Vector<Real> v_1) const noexcept {
    Vector<Real> w_0 = v_0;
    Vector<Real> w_1 = v_1;
    apply(v_0, v_1, w_0, w_1);
    return hn::MulAdd(w_1, w_1, hn::Mul(w_0, w_0));
  }
};

// The model at one point of the iteration.
template <class Real>
struct Linearisation {
  Vector<Real> r[2];     // z - h(p)
  Vector<Real> J[2][3];  // dh/dp
  Vector<Real> cost;
  Vector<Real> status;
};

// What stays the same during an update, for the lanes of one vector.
template <class Real>
struct Problem {
  const UpdateTask<Real>* task = nullptr;
  Vector<Real> z[2];
  Vector<Real> S[6];
  Vector<Real> p_hat[3];
  Whitening<Real> R_factor;
};

template <class V>
HWY_INLINE void choose(hn::Mask<hn::DFromV<V>> mask, const V& from, V& to) noexcept {
  to = hn::IfThenElse(mask, from, to);
}

template <class Real>
HWY_INLINE void choose(Mask<Real> mask, const Linearisation<Real>& from, Linearisation<Real>& to) noexcept {
  for (int i = 0; i < 2; ++i) {
    choose(mask, from.r[i], to.r[i]);
    for (int j = 0; j < 3; ++j) choose(mask, from.J[i][j], to.J[i][j]);
  }
  choose(mask, from.cost, to.cost);
}

// Pinhole with Brown-Conrady distortion at q (frame C): residuals, their Jacobian dh/dq, status. See CameraModel.
template <class Real>
HWY_INLINE void project(const PinholeLens<Real>& lens, const Vector<Real>* z, const Vector<Real>* q, Vector<Real>* r,
                        Vector<Real> (*J_q)[3], Vector<Real>& status) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const auto set = [](Real value) HWY_ATTR { return hn::Set(Tag<Real>(), value); };
  const V one = set(1);
  const V two = set(2);
  const V six = set(6);
  const V inverse_depth = hn::Div(one, q[2]);
  const V x = hn::Mul(q[0], inverse_depth);
  const V y = hn::Mul(q[1], inverse_depth);
  const V xx = hn::Mul(x, x);
  const V xy = hn::Mul(x, y);
  const V yy = hn::Mul(y, y);
  const V r2 = hn::Add(xx, yy);
  const V k1 = set(lens.k1);
  const V k2 = set(lens.k2);
  const V k3 = set(lens.k3);
  const V p1 = set(lens.p1);
  const V p2 = set(lens.p2);
  const V radial = hn::MulAdd(r2, hn::MulAdd(r2, hn::MulAdd(r2, k3, k2), k1), one);
  const V slope = hn::MulAdd(r2, hn::MulAdd(r2, hn::Mul(set(3), k3), hn::Add(k2, k2)), k1);  // d radial / d r2
  const V twice_xy = hn::Add(xy, xy);
  const V m_x = hn::MulAdd(p2, hn::MulAdd(two, xx, r2), hn::MulAdd(p1, twice_xy, hn::Mul(x, radial)));
  const V m_y = hn::MulAdd(p1, hn::MulAdd(two, yy, r2), hn::MulAdd(p2, twice_xy, hn::Mul(y, radial)));
  const V D_xy = hn::MulAdd(twice_xy, slope, hn::Mul(two, hn::MulAdd(p1, x, hn::Mul(p2, y))));
  const V p1_y = hn::Mul(p1, y);
  const V p2_x = hn::Mul(p2, x);
  const V D_xx = hn::MulAdd(six, p2_x, hn::MulAdd(two, p1_y, hn::MulAdd(hn::Mul(two, xx), slope, radial)));
  const V D_yy = hn::MulAdd(two, p2_x, hn::MulAdd(six, p1_y, hn::MulAdd(hn::Mul(two, yy), slope, radial)));
  // 1 + 3 k1 r2 + 5 k2 r2^2 + 7 k3 r2^3 = d(r radial)/dr must be positive all the way out to r2.
  const V growth =
      hn::MulAdd(r2, hn::MulAdd(r2, hn::MulAdd(r2, set(7 * lens.k3), set(5 * lens.k2)), set(3 * lens.k1)), one);
  const V determinant = hn::NegMulAdd(D_xy, D_xy, hn::Mul(D_xx, D_yy));
  const Mask<Real> unfolded = hn::And(hn::Gt(determinant, hn::Zero(tag)),
                                      hn::And(hn::Gt(growth, hn::Zero(tag)), hn::Le(r2, set(lens.turn_r2))));
  const Mask<Real> q_finite = hn::And(hn::IsFinite(q[0]), hn::And(hn::IsFinite(q[1]), hn::IsFinite(q[2])));
  const Mask<Real> m_finite = hn::And(hn::IsFinite(m_x), hn::IsFinite(m_y));
  status = hn::IfThenElse(unfolded, number<Real>(UpdateStatus::kAccepted), number<Real>(UpdateStatus::kFoldedBack));
  status = hn::IfThenElse(m_finite, status, number<Real>(UpdateStatus::kNotFinite));
  status = hn::IfThenElse(hn::Lt(q[2], set(kMinDepth<Real>)), number<Real>(UpdateStatus::kBehindCamera), status);
  status = hn::IfThenElse(q_finite, status, number<Real>(UpdateStatus::kNotFinite));

  const V fx = set(lens.fx);
  const V fy = set(lens.fy);
  r[0] = hn::Sub(z[0], hn::MulAdd(fx, m_x, set(lens.cx)));
  r[1] = hn::Sub(z[1], hn::MulAdd(fy, m_y, set(lens.cy)));
  const V g_x = hn::Mul(fx, inverse_depth);
  const V g_y = hn::Mul(fy, inverse_depth);
  J_q[0][0] = hn::Mul(g_x, D_xx);
  J_q[0][1] = hn::Mul(g_x, D_xy);
  J_q[0][2] = hn::Neg(hn::MulAdd(J_q[0][0], x, hn::Mul(J_q[0][1], y)));
  J_q[1][0] = hn::Mul(g_y, D_xy);
  J_q[1][1] = hn::Mul(g_y, D_yy);
  J_q[1][2] = hn::Neg(hn::MulAdd(J_q[1][0], x, hn::Mul(J_q[1][1], y)));
}

template <class Real>
HWY_NOINLINE void linearise_lane_by_lane(const Problem<Real>& problem, Mask<Real> wanted, const Vector<Real>* q,
                                         Vector<Real>* r, Vector<Real> (*J_q)[3], Vector<Real>& status) noexcept {
  const Tag<Real> tag;
  HWY_ALIGN Real wanted_lanes[kLanes] = {};
  HWY_ALIGN Real z_lanes[2 * kLanes] = {};
  HWY_ALIGN Real q_lanes[3 * kLanes] = {};
  HWY_ALIGN Real r_lanes[2 * kLanes] = {};
  HWY_ALIGN Real J_lanes[6 * kLanes] = {};
  HWY_ALIGN Real status_lanes[kLanes] = {};
  hn::Store(hn::IfThenElseZero(wanted, hn::Set(tag, Real(1))), tag, wanted_lanes);
  for (int i = 0; i < 2; ++i) hn::Store(problem.z[i], tag, z_lanes + i * kLanes);
  for (int i = 0; i < 3; ++i) hn::Store(q[i], tag, q_lanes + i * kLanes);
  const LaneModel<Real>& model = problem.task->other_model;
  model.linearise(model.model, static_cast<int>(hn::Lanes(tag)), wanted_lanes, z_lanes, q_lanes, r_lanes, J_lanes,
                  status_lanes);
  for (int i = 0; i < 2; ++i) {
    r[i] = hn::Load(tag, r_lanes + i * kLanes);
    for (int j = 0; j < 3; ++j) J_q[i][j] = hn::Load(tag, J_lanes + (3 * i + j) * kLanes);
  }
  status = hn::Load(tag, status_lanes);
}

// The model at p = p^ + w, where w = S lambda and the prior's part of the cost is lambda . w.
template <class Real>
HWY_INLINE void linearise(const Problem<Real>& problem, Mask<Real> wanted, const Vector<Real>* lambda,
                          const Vector<Real>* w, Linearisation<Real>& at_point) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const UpdateTask<Real>& task = *problem.task;
  const V p[3] = {hn::Add(problem.p_hat[0], w[0]), hn::Add(problem.p_hat[1], w[1]), hn::Add(problem.p_hat[2], w[2])};
  V R_CW[9];
  for (int i = 0; i < 9; ++i) R_CW[i] = hn::Set(tag, task.R_CW[i]);
  V q[3];
  for (int i = 0; i < 3; ++i) q[i] = hn::Add(dot3(R_CW + 3 * i, p), hn::Set(tag, task.t_CW[i]));
  V J_q[2][3];
  if (task.lens != nullptr) {
    project(*task.lens, problem.z, q, at_point.r, J_q, at_point.status);
  } else {
    linearise_lane_by_lane(problem, wanted, q, at_point.r, J_q, at_point.status);
  }
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 3; ++j) {
      at_point.J[i][j] =
          hn::MulAdd(J_q[i][2], R_CW[6 + j], hn::MulAdd(J_q[i][1], R_CW[3 + j], hn::Mul(J_q[i][0], R_CW[j])));
    }
  }
  at_point.cost = hn::Add(dot3(lambda, w), problem.R_factor.squared_length(at_point.r[0], at_point.r[1]));
  const Mask<Real> not_finite =
      hn::And(hn::Eq(at_point.status, number<Real>(UpdateStatus::kAccepted)), hn::Not(hn::IsFinite(at_point.cost)));
  choose(not_finite, number<Real>(UpdateStatus::kNotFinite), at_point.status);
}

// J S J^T (2x2, lower triangle).
template <class Real>
HWY_INLINE void predicted_covariance(const Vector<Real> (*J)[3], const Vector<Real>* S, Vector<Real>* G) noexcept {
  Vector<Real> JS[2][3];
  times_symmetric(S, J[0], JS[0]);
  times_symmetric(S, J[1], JS[1]);
  G[0] = dot3(JS[0], J[0]);
  G[1] = dot3(JS[1], J[0]);
  G[2] = dot3(JS[1], J[1]);
}

// The lanes that still take part, and why the others do not.
template <class Real>
struct Progress {
  Mask<Real> alive;
  Vector<Real> status;

  HWY_INLINE void refuse(Mask<Real> lanes, Vector<Real> why) noexcept {
    choose(hn::And(alive, lanes), why, status);
    alive = hn::AndNot(lanes, alive);
  }
};

template <class Real>
HWY_INLINE Mask<Real> considered_lanes(LaneMask considered, int lane) noexcept {
  HWY_ALIGN Real flags[kLanes] = {};
  for (int l = 0; l + lane < kLanes; ++l) flags[l] = (considered >> (l + lane) & 1) != 0 ? Real(1) : Real(0);
  const Tag<Real> tag;
  return hn::Gt(hn::Load(tag, flags), hn::Zero(tag));
}

// U and the new state in the lanes still alive; refuses those whose state or variances would go bad.
template <class Real>
HWY_INLINE void commit(const GroupView<Real>& group, const UpdateTask<Real>& task, int lane, const Vector<Real>* lambda,
                       const Vector<Real> (*K)[2], Progress<Real>& progress) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  HWY_ALIGN Real x_before[kMaxState * kLanes];
  HWY_ALIGN Real diagonal_before[kMaxState * kLanes];
  V l[3];
  V k[3][2];
  for (int c = 0; c < 3; ++c) {
    l[c] = hn::IfThenElseZero(progress.alive, lambda[c]);
    for (int m = 0; m < 2; ++m) k[c][m] = hn::IfThenElseZero(progress.alive, K[c][m]);
  }
  // Stays zero as long as every term is finite: one infinity or NaN makes it NaN.
  V finite = hn::Zero(tag);
  Mask<Real> positive = progress.alive;
  // A store of a vector may change anything, as far as the compiler knows: what stays the same is kept outside.
  const int d = group.d;
  Real* const x_first = at(group.x, 0, lane);
  Real* const variance_first = at(group.diagonal, 0, lane);
  Real* const U_first = at(task.U, 0, lane);
  const Real* const M_0 = at(task.gain, 0, lane);
  const Real* const M_1 = at(task.gain, d, lane);
  const Real* const M_2 = at(task.gain, 2 * d, lane);
  for (int i = 0; i < d; ++i) {
    Real* x = x_first + i * kLanes;
    Real* variance = variance_first + i * kLanes;
    const V M[3] = {hn::Load(tag, M_0 + i * kLanes), hn::Load(tag, M_1 + i * kLanes), hn::Load(tag, M_2 + i * kLanes)};
    const V x_old = hn::Load(tag, x);
    const V variance_old = hn::Load(tag, variance);
    const V x_new = hn::Add(x_old, dot3(M, l));
    const V U_0 = hn::MulAdd(M[2], k[2][0], hn::MulAdd(M[1], k[1][0], hn::Mul(M[0], k[0][0])));
    const V U_1 = hn::MulAdd(M[2], k[2][1], hn::MulAdd(M[1], k[1][1], hn::Mul(M[0], k[0][1])));
    const V variance_new = hn::NegMulAdd(U_1, U_1, hn::NegMulAdd(U_0, U_0, variance_old));
    finite = hn::MulAdd(x_new, hn::Zero(tag), finite);
    positive = hn::And(positive, hn::Gt(variance_new, hn::Zero(tag)));
    hn::Store(U_0, tag, U_first + 2 * i * kLanes);
    hn::Store(U_1, tag, U_first + (2 * i + 1) * kLanes);
    hn::Store(x_old, tag, x_before + i * kLanes);
    hn::Store(variance_old, tag, diagonal_before + i * kLanes);
    hn::Store(x_new, tag, x);
    hn::Store(variance_new, tag, variance);
  }
  const Mask<Real> spoilt = hn::Not(hn::Eq(finite, hn::Zero(tag)));
  const Mask<Real> lost = hn::Or(spoilt, hn::AndNot(positive, progress.alive));
  progress.refuse(spoilt, number<Real>(UpdateStatus::kNotFinite));
  progress.refuse(hn::Not(positive), number<Real>(UpdateStatus::kNotPositive));
  if (hn::AllFalse(tag, lost)) return;
  const auto restore = [&](Real* elements, V before) HWY_ATTR {
    hn::Store(hn::IfThenElse(lost, before, hn::Load(tag, elements)), tag, elements);
  };
  for (int i = 0; i < group.d; ++i) {
    restore(at(group.x, i, lane), hn::Load(tag, x_before + i * kLanes));
    restore(at(group.diagonal, i, lane), hn::Load(tag, diagonal_before + i * kLanes));
    restore(at(task.U, 2 * i, lane), hn::Zero(tag));
    restore(at(task.U, 2 * i + 1, lane), hn::Zero(tag));
  }
}

template <class Real>
HWY_INLINE void update_lanes(const GroupView<Real>& group, const UpdateTask<Real>& task, int lane,
                             LaneOutcomes<Real>& outcomes) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const V zero = hn::Zero(tag);
  const V one = hn::Set(tag, Real(1));
  const V accepted = number<Real>(UpdateStatus::kAccepted);
  const V not_positive = number<Real>(UpdateStatus::kNotPositive);
  const UpdateSettings& settings = task.settings;
  const LaneObservations<Real>& observations = *task.observations;

  Problem<Real> problem;
  problem.task = &task;
  V R[3];
  for (int i = 0; i < 2; ++i) problem.z[i] = hn::LoadU(tag, observations.z[i] + lane);
  for (int i = 0; i < 3; ++i) R[i] = hn::LoadU(tag, observations.R[i] + lane);
  for (int i = 0; i < 6; ++i) problem.S[i] = hn::Load(tag, at(task.S, i, lane));
  const V* S = problem.S;
  // The axes side by side: each sum is one chain.
  V p_hat[3] = {zero, zero, zero};
  const int n = group.n;
  const Real* x = at(group.x, 0, lane);
  for (int k = 0; k < n; ++k) {
    const V b = hn::Set(tag, task.phase->b[static_cast<std::size_t>(k)]);
    for (int a = 0; a < 3; ++a) p_hat[a] = hn::MulAdd(hn::Load(tag, x + (a * n + k) * kLanes), b, p_hat[a]);
  }
  for (int a = 0; a < 3; ++a) problem.p_hat[a] = p_hat[a];

  Progress<Real> progress{considered_lanes<Real>(task.considered, lane), accepted};
  V sum = zero;
  for (const V& z : problem.z) sum = hn::MulAdd(z, zero, sum);
  for (const V& r : R) sum = hn::MulAdd(r, zero, sum);
  progress.refuse(hn::Not(hn::Eq(sum, zero)), number<Real>(UpdateStatus::kNotFinite));
  progress.refuse(hn::Not(problem.R_factor.factor(R[0], R[1], R[2])), not_positive);

  V lambda[3] = {zero, zero, zero};
  V w[3] = {zero, zero, zero};  // S lambda
  Linearisation<Real> now;
  linearise(problem, progress.alive, lambda, w, now);
  progress.refuse(hn::Ne(now.status, accepted), now.status);
  for (int i = 0; i < 2; ++i) {
    hn::StoreU(hn::IfThenElseZero(progress.alive, now.r[i]), tag, outcomes.innovation[i] + lane);
  }
  V G[3];  // J S J^T at `now`
  predicted_covariance<Real>(now.J, S, G);
  Whitening<Real> whitening;
  progress.refuse(hn::Not(whitening.factor(hn::Add(G[0], R[0]), hn::Add(G[1], R[1]), hn::Add(G[2], R[2]))),
                  not_positive);
  hn::StoreU(hn::IfThenElseZero(progress.alive, whitening.squared_length(now.r[0], now.r[1])), tag,
             outcomes.normalised_innovation_squared + lane);

  const bool at_final = settings.covariance == CovarianceLinearisation::kFinalIterate;
  const bool damped = settings.method == UpdateMethod::kLevenbergMarquardt;
  const V step_factor = hn::Set(tag, damped ? Real(1) : static_cast<Real>(settings.step_factor));
  const V tolerance2 = hn::Set(tag, static_cast<Real>(settings.tolerance * settings.tolerance));
  V mu = zero;
  V iterations = zero;
  V last_failure = accepted;
  Mask<Real> moved = hn::Ne(zero, zero);
  Mask<Real> iterating = progress.alive;
  V J_before[2][3];
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 3; ++j) J_before[i][j] = now.J[i][j];
  }
  for (int iteration = 0; iteration < settings.max_iterations && !hn::AllFalse(tag, iterating); ++iteration) {
    iterations = hn::Add(iterations, hn::IfThenElseZero(iterating, one));
    const V damping = hn::Add(one, mu);
    const V A[3] = {hn::MulAdd(damping, R[0], G[0]), hn::MulAdd(damping, R[1], G[1]), hn::MulAdd(damping, R[2], G[2])};
    const V determinant = difference_of_products(A[0], A[2], A[1], A[1]);
    const Mask<Real> positive =
        hn::And(hn::And(hn::Gt(A[0], zero), hn::Gt(determinant, zero)), hn::IsFinite(determinant));
    progress.refuse(hn::AndNot(positive, iterating), not_positive);
    iterating = hn::And(iterating, progress.alive);
    // v = A^-1 g by Cramer's rule.
    const V g_0 = hn::MulAdd(damping, now.r[0], dot3(now.J[0], w));
    const V g_1 = hn::MulAdd(damping, now.r[1], dot3(now.J[1], w));
    const V inverse = hn::Div(one, determinant);
    const V v_0 = hn::Mul(difference_of_products(A[2], g_0, A[1], g_1), inverse);
    const V v_1 = hn::Mul(difference_of_products(A[0], g_1, A[1], g_0), inverse);
    const V scale = hn::Div(step_factor, damping);
    V step[3];
    V trial[3];
    V S_step[3];
    V w_trial[3];
    for (int j = 0; j < 3; ++j) {
      step[j] = hn::Mul(scale, hn::Sub(hn::MulAdd(now.J[1][j], v_1, hn::Mul(now.J[0][j], v_0)), lambda[j]));
      trial[j] = hn::Add(lambda[j], step[j]);
    }
    times_symmetric(S, step, S_step);
    for (int j = 0; j < 3; ++j) w_trial[j] = hn::Add(w[j], S_step[j]);
    const V prior_length2 = dot3(step, S_step);
    const V length2 =
        hn::Add(prior_length2, problem.R_factor.squared_length(dot3(now.J[0], S_step), dot3(now.J[1], S_step)));
    Linearisation<Real> next;
    linearise(problem, iterating, trial, w_trial, next);
    const Mask<Real> failed = hn::Ne(next.status, accepted);
    Mask<Real> taken = iterating;
    if (damped) {
      const V slack = hn::MulAdd(hn::Set(tag, kCostSlack<Real>), now.cost, hn::Set(tag, kCostSlack<Real>));
      const Mask<Real> falls = hn::And(hn::Le(next.cost, hn::Add(now.cost, slack)), hn::Not(failed));
      taken = hn::And(iterating, falls);
      const Mask<Real> rejected = hn::AndNot(falls, iterating);
      choose(rejected, next.status, last_failure);
      const Mask<Real> undamped = hn::Eq(mu, zero);
      const V twice = hn::Add(mu, mu);
      const V mu_rejected = hn::IfThenElse(undamped, one, hn::Add(twice, twice));
      const V expected_fall = hn::MulAdd(twice, prior_length2, length2);
      const V fall = hn::Sub(now.cost, next.cost);
      const Mask<Real> telling = hn::And(taken, hn::Gt(expected_fall, slack));
      const Mask<Real> poor = hn::Lt(fall, hn::Mul(hn::Set(tag, Real(0.25)), expected_fall));
      const Mask<Real> good = hn::Gt(fall, hn::Mul(hn::Set(tag, Real(0.75)), expected_fall));
      const V mu_poor = hn::IfThenElse(undamped, hn::Set(tag, Real(0.5)), twice);
      const V mu_good = hn::IfThenElseZero(hn::Gt(mu, hn::Set(tag, Real(1e-2))), hn::Mul(hn::Set(tag, Real(0.25)), mu));
      choose(hn::And(telling, good), mu_good, mu);
      choose(hn::And(telling, poor), mu_poor, mu);
      choose(rejected, mu_rejected, mu);
    } else {
      progress.refuse(hn::And(iterating, failed), next.status);
      taken = hn::And(iterating, progress.alive);
    }
    if (!at_final) {
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 3; ++j) choose(taken, now.J[i][j], J_before[i][j]);
      }
    }
    if (hn::AllTrue(tag, taken)) {
      for (int j = 0; j < 3; ++j) {
        lambda[j] = trial[j];
        w[j] = w_trial[j];
      }
      now = next;
    } else {
      for (int j = 0; j < 3; ++j) {
        choose(taken, trial[j], lambda[j]);
        choose(taken, w_trial[j], w[j]);
      }
      choose<Real>(taken, next, now);
    }
    predicted_covariance<Real>(now.J, S, G);
    moved = hn::Or(moved, taken);
    iterating = hn::And(iterating, progress.alive);
    iterating = hn::AndNot(hn::And(taken, hn::Lt(length2, tolerance2)), iterating);
  }
  progress.refuse(hn::AndNot(moved, hn::Ne(last_failure, accepted)), last_failure);
  hn::StoreU(hn::IfThenElseZero(progress.alive, now.cost), tag, outcomes.map_cost + lane);
  progress.refuse(hn::Not(hn::Le(now.cost, hn::Set(tag, static_cast<Real>(settings.gate)))),
                  number<Real>(UpdateStatus::kRejectedByGate));

  const V(*J)[3] = at_final ? now.J : J_before;
  if (!at_final) predicted_covariance<Real>(J, S, G);
  progress.refuse(hn::Not(whitening.factor(hn::Add(G[0], R[0]), hn::Add(G[1], R[1]), hn::Add(G[2], R[2]))),
                  not_positive);
  // U = M J^T L^-T, so that U U^T = M J^T (J S J^T + R)^-1 J M^T.
  V K[3][2];
  for (int j = 0; j < 3; ++j) whitening.apply(J[0][j], J[1][j], K[j][0], K[j][1]);
  commit<Real>(group, task, lane, lambda, K, progress);

  HWY_ALIGN Real status_lanes[kLanes] = {};
  HWY_ALIGN Real iteration_lanes[kLanes] = {};
  hn::Store(progress.status, tag, status_lanes);
  hn::Store(iterations, tag, iteration_lanes);
  for (int l = 0; l < static_cast<int>(hn::Lanes(tag)); ++l) {
    if ((task.considered >> (lane + l) & 1) == 0) continue;
    outcomes.status[lane + l] = static_cast<UpdateStatus>(static_cast<int>(status_lanes[l]));
    outcomes.iterations[lane + l] = static_cast<int>(iteration_lanes[l]);
    if (outcomes.status[lane + l] == UpdateStatus::kAccepted) {
      outcomes.accepted = static_cast<LaneMask>(outcomes.accepted | 1U << (lane + l));
    }
  }
}

template <class Real>
void update(const GroupView<Real>& group, const UpdateTask<Real>& task, LaneOutcomes<Real>& outcomes) noexcept {
  outcomes.considered = task.considered;
  outcomes.accepted = 0;
  for (int lane = 0; lane < kLanes; lane += static_cast<int>(hn::Lanes(Tag<Real>()))) {
    update_lanes(group, task, lane, outcomes);
  }
}

const UpdateKernels<double>* update_table_double() {
  static constexpr UpdateKernels<double> kTable{&update<double>};
  return &kTable;
}

const UpdateKernels<float>* update_table_float() {
  static constexpr UpdateKernels<float> kTable{&update<float>};
  return &kTable;
}

}  // namespace perimap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace perimap {

HWY_EXPORT(update_table_double);
HWY_EXPORT(update_table_float);

template <>
const UpdateKernels<double>& update_kernels(SimdTarget target) {
  return *with_target(target, [] { return HWY_DYNAMIC_DISPATCH(update_table_double)(); });
}

template <>
const UpdateKernels<float>& update_kernels(SimdTarget target) {
  return *with_target(target, [] { return HWY_DYNAMIC_DISPATCH(update_table_float)(); });
}

}  // namespace perimap
#endif
