// The measurement model and its linearisation, eight lanes at a time: what an update asks of a point. Compiled once for
// each instruction set, by the file that includes it between Highway's foreach_target.h and its end.
#if defined(PERIMAP_CORE_BANK_LANE_LINEARISATION) == defined(HWY_TARGET_TOGGLE)
#ifdef PERIMAP_CORE_BANK_LANE_LINEARISATION
#undef PERIMAP_CORE_BANK_LANE_LINEARISATION
#else
#define PERIMAP_CORE_BANK_LANE_LINEARISATION
#endif

#include <hwy/highway.h>

#include "core/bank/update_kernels.hpp"

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

}  // namespace perimap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
