#include "core/bank/update_kernels.hpp"

#include "core/simd/target_choice.hpp"

#undef HWY_TARGET_INCLUDE
// Highway reads its name and compiles it once for each target.
#define HWY_TARGET_INCLUDE "core/bank/update_kernels.cpp"  // NOLINT(cppcoreguidelines-macro-usage)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/bank/lane_linearisation-inl.hpp"

// The steps and their reasons are those of core/estimation/iterated_update.cpp, with a lane mask in place of each
// branch. Lanes that are done or refused keep computing; what they compute is dropped.
HWY_BEFORE_NAMESPACE();
namespace perimap::HWY_NAMESPACE {

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

// The measurement and the prior at its phase: all that the iteration asks of the bank. Refuses the lanes where they are
// no numbers or R is not positive definite.
template <class Real>
HWY_INLINE void pose_problem(const GroupView<Real>& group, const UpdateTask<Real>& task, int lane,
                             Problem<Real>& problem, Vector<Real>* R, Progress<Real>& progress) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const V zero = hn::Zero(tag);
  const LaneObservations<Real>& observations = *task.observations;
  problem.task = &task;
  for (int i = 0; i < 2; ++i) problem.z[i] = hn::LoadU(tag, observations.z[i] + lane);
  for (int i = 0; i < 3; ++i) R[i] = hn::LoadU(tag, observations.R[i] + lane);
  for (int i = 0; i < 6; ++i) problem.S[i] = hn::Load(tag, at(task.S, i, lane));
  // The axes side by side: each sum is one chain.
  V p_hat[3] = {zero, zero, zero};
  const int n = group.n;
  const Real* x = at(group.x, 0, lane);
  for (int k = 0; k < n; ++k) {
    const V b = hn::Set(tag, task.phase->b[static_cast<std::size_t>(k)]);
    for (int a = 0; a < 3; ++a) p_hat[a] = hn::MulAdd(hn::Load(tag, x + (a * n + k) * kLanes), b, p_hat[a]);
  }
  for (int a = 0; a < 3; ++a) problem.p_hat[a] = p_hat[a];
  V sum = zero;
  for (const V& z : problem.z) sum = hn::MulAdd(z, zero, sum);
  for (int i = 0; i < 3; ++i) sum = hn::MulAdd(R[i], zero, sum);
  progress.refuse(hn::Not(hn::Eq(sum, zero)), number<Real>(UpdateStatus::kNotFinite));
  progress.refuse(hn::Not(problem.R_factor.factor(R[0], R[1], R[2])), number<Real>(UpdateStatus::kNotPositive));
}

// What goes from step to step.
template <class Real>
struct Iteration {
  Vector<Real> lambda[3];
  Vector<Real> w[3];  // S lambda
  Linearisation<Real> now;
  Vector<Real> G[3];  // J S J^T at `now`
  Vector<Real> J_before[2][3];
  Vector<Real> mu;
  Vector<Real> count;
  Vector<Real> last_failure;
  Mask<Real> moved;
  Mask<Real> iterating;
};

template <class Real>
struct Step {
  Vector<Real> lambda[3];  // after it
  Vector<Real> w[3];
  Vector<Real> prior_length2;
  Vector<Real> length2;  // in posterior standard deviations
};

// Refuses the lanes whose damped equations can not be solved.
template <class Real>
HWY_INLINE void next_step(const Problem<Real>& problem, const Vector<Real>* R, Vector<Real> step_factor,
                          Iteration<Real>& it, Progress<Real>& progress, Step<Real>& to) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const V zero = hn::Zero(tag);
  const V one = hn::Set(tag, Real(1));
  const Linearisation<Real>& now = it.now;
  const V damping = hn::Add(one, it.mu);
  const V A[3] = {hn::MulAdd(damping, R[0], it.G[0]), hn::MulAdd(damping, R[1], it.G[1]),
                  hn::MulAdd(damping, R[2], it.G[2])};
  const V determinant = difference_of_products(A[0], A[2], A[1], A[1]);
  const Mask<Real> positive =
      hn::And(hn::And(hn::Gt(A[0], zero), hn::Gt(determinant, zero)), hn::IsFinite(determinant));
  progress.refuse(hn::AndNot(positive, it.iterating), number<Real>(UpdateStatus::kNotPositive));
  it.iterating = hn::And(it.iterating, progress.alive);
  // v = A^-1 g by Cramer's rule.
  const V g_0 = hn::MulAdd(damping, now.r[0], dot3(now.J[0], it.w));
  const V g_1 = hn::MulAdd(damping, now.r[1], dot3(now.J[1], it.w));
  const V inverse = hn::Div(one, determinant);
  const V v_0 = hn::Mul(difference_of_products(A[2], g_0, A[1], g_1), inverse);
  const V v_1 = hn::Mul(difference_of_products(A[0], g_1, A[1], g_0), inverse);
  const V scale = hn::Div(step_factor, damping);
  V step[3];
  V S_step[3];
  for (int j = 0; j < 3; ++j) {
    step[j] = hn::Mul(scale, hn::Sub(hn::MulAdd(now.J[1][j], v_1, hn::Mul(now.J[0][j], v_0)), it.lambda[j]));
    to.lambda[j] = hn::Add(it.lambda[j], step[j]);
  }
  times_symmetric(problem.S, step, S_step);
  for (int j = 0; j < 3; ++j) to.w[j] = hn::Add(it.w[j], S_step[j]);
  to.prior_length2 = dot3(step, S_step);
  to.length2 =
      hn::Add(to.prior_length2, problem.R_factor.squared_length(dot3(now.J[0], S_step), dot3(now.J[1], S_step)));
}

// The lanes whose cost falls, or rises by no more than rounding; and the damping of the next step, by how much of the
// expected fall there was (see iterated_update.cpp).
template <class Real>
HWY_INLINE Mask<Real> judge_damped(const Step<Real>& step, const Linearisation<Real>& next,
                                   Iteration<Real>& it) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const V cost = it.now.cost;
  const Mask<Real> failed = hn::Ne(next.status, number<Real>(UpdateStatus::kAccepted));
  const V slack = hn::MulAdd(hn::Set(tag, kCostSlack<Real>), cost, hn::Set(tag, kCostSlack<Real>));
  const Mask<Real> falls = hn::And(hn::Le(next.cost, hn::Add(cost, slack)), hn::Not(failed));
  const Mask<Real> taken = hn::And(it.iterating, falls);
  const Mask<Real> rejected = hn::AndNot(falls, it.iterating);
  choose(rejected, next.status, it.last_failure);
  const V mu = it.mu;
  const Mask<Real> undamped = hn::Eq(mu, hn::Zero(tag));
  const V twice = hn::Add(mu, mu);
  const V mu_rejected = hn::IfThenElse(undamped, hn::Set(tag, Real(1)), hn::Add(twice, twice));
  const V expected_fall = hn::MulAdd(twice, step.prior_length2, step.length2);
  const V fall = hn::Sub(cost, next.cost);
  const Mask<Real> telling = hn::And(taken, hn::Gt(expected_fall, slack));
  const Mask<Real> poor = hn::Lt(fall, hn::Mul(hn::Set(tag, Real(0.25)), expected_fall));
  const Mask<Real> good = hn::Gt(fall, hn::Mul(hn::Set(tag, Real(0.75)), expected_fall));
  const V mu_poor = hn::IfThenElse(undamped, hn::Set(tag, Real(0.5)), twice);
  const V mu_good = hn::IfThenElseZero(hn::Gt(mu, hn::Set(tag, Real(1e-2))), hn::Mul(hn::Set(tag, Real(0.25)), mu));
  choose(hn::And(telling, good), mu_good, it.mu);
  choose(hn::And(telling, poor), mu_poor, it.mu);
  choose(rejected, mu_rejected, it.mu);
  return taken;
}

template <class Real>
HWY_INLINE void take(Mask<Real> taken, const Step<Real>& step, const Linearisation<Real>& next,
                     Iteration<Real>& it) noexcept {
  if (hn::AllTrue(Tag<Real>(), taken)) {
    for (int j = 0; j < 3; ++j) {
      it.lambda[j] = step.lambda[j];
      it.w[j] = step.w[j];
    }
    it.now = next;
    return;
  }
  for (int j = 0; j < 3; ++j) {
    choose(taken, step.lambda[j], it.lambda[j]);
    choose(taken, step.w[j], it.w[j]);
  }
  choose<Real>(taken, next, it.now);
}

template <class Real>
HWY_INLINE void iterate(const Problem<Real>& problem, const Vector<Real>* R, const UpdateSettings& settings,
                        Iteration<Real>& it, Progress<Real>& progress) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const bool at_final = settings.covariance == CovarianceLinearisation::kFinalIterate;
  const bool damped = settings.method == UpdateMethod::kLevenbergMarquardt;
  const V step_factor = hn::Set(tag, damped ? Real(1) : static_cast<Real>(settings.step_factor));
  const V tolerance2 = hn::Set(tag, static_cast<Real>(settings.tolerance * settings.tolerance));
  for (int i = 0; i < settings.max_iterations && !hn::AllFalse(tag, it.iterating); ++i) {
    it.count = hn::Add(it.count, hn::IfThenElseZero(it.iterating, hn::Set(tag, Real(1))));
    Step<Real> step;
    next_step<Real>(problem, R, step_factor, it, progress, step);
    Linearisation<Real> next;
    linearise(problem, it.iterating, step.lambda, step.w, next);
    Mask<Real> taken = it.iterating;
    if (damped) {
      taken = judge_damped<Real>(step, next, it);
    } else {
      const Mask<Real> failed = hn::Ne(next.status, number<Real>(UpdateStatus::kAccepted));
      progress.refuse(hn::And(it.iterating, failed), next.status);
      taken = hn::And(it.iterating, progress.alive);
    }
    if (!at_final) {
      for (int a = 0; a < 2; ++a) {
        for (int j = 0; j < 3; ++j) choose(taken, it.now.J[a][j], it.J_before[a][j]);
      }
    }
    take<Real>(taken, step, next, it);
    predicted_covariance<Real>(it.now.J, problem.S, it.G);
    it.moved = hn::Or(it.moved, taken);
    it.iterating = hn::And(it.iterating, progress.alive);
    it.iterating = hn::AndNot(hn::And(taken, hn::Lt(step.length2, tolerance2)), it.iterating);
  }
}

template <class Real>
HWY_INLINE void tell_outcomes(LaneMask considered, int lane, Vector<Real> status, Vector<Real> iterations,
                              LaneOutcomes<Real>& outcomes) noexcept {
  const Tag<Real> tag;
  HWY_ALIGN Real status_lanes[kLanes] = {};
  HWY_ALIGN Real iteration_lanes[kLanes] = {};
  hn::Store(status, tag, status_lanes);
  hn::Store(iterations, tag, iteration_lanes);
  for (int l = 0; l < static_cast<int>(hn::Lanes(tag)); ++l) {
    if ((considered >> (lane + l) & 1) == 0) continue;
    outcomes.status[lane + l] = static_cast<UpdateStatus>(static_cast<int>(status_lanes[l]));
    outcomes.iterations[lane + l] = static_cast<int>(iteration_lanes[l]);
    if (outcomes.status[lane + l] == UpdateStatus::kAccepted) {
      outcomes.accepted = static_cast<LaneMask>(outcomes.accepted | 1U << (lane + l));
    }
  }
}

template <class Real>
HWY_INLINE void update_lanes(const GroupView<Real>& group, const UpdateTask<Real>& task, int lane,
                             LaneOutcomes<Real>& outcomes) noexcept {
  using V = Vector<Real>;
  const Tag<Real> tag;
  const V zero = hn::Zero(tag);
  const V accepted = number<Real>(UpdateStatus::kAccepted);
  const V not_positive = number<Real>(UpdateStatus::kNotPositive);
  const UpdateSettings& settings = task.settings;

  Problem<Real> problem;
  V R[3];
  Progress<Real> progress{considered_lanes<Real>(task.considered, lane), accepted};
  pose_problem<Real>(group, task, lane, problem, R, progress);

  Iteration<Real> it;
  for (int j = 0; j < 3; ++j) it.lambda[j] = it.w[j] = zero;
  linearise(problem, progress.alive, it.lambda, it.w, it.now);
  progress.refuse(hn::Ne(it.now.status, accepted), it.now.status);
  for (int i = 0; i < 2; ++i) {
    hn::StoreU(hn::IfThenElseZero(progress.alive, it.now.r[i]), tag, outcomes.innovation[i] + lane);
  }
  predicted_covariance<Real>(it.now.J, problem.S, it.G);
  Whitening<Real> whitening;
  const auto whiten = [&](const V* G) HWY_ATTR {
    progress.refuse(hn::Not(whitening.factor(hn::Add(G[0], R[0]), hn::Add(G[1], R[1]), hn::Add(G[2], R[2]))),
                    not_positive);
  };
  whiten(it.G);
  hn::StoreU(hn::IfThenElseZero(progress.alive, whitening.squared_length(it.now.r[0], it.now.r[1])), tag,
             outcomes.normalised_innovation_squared + lane);

  it.mu = it.count = zero;
  it.last_failure = accepted;
  it.moved = hn::Ne(zero, zero);
  it.iterating = progress.alive;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 3; ++j) it.J_before[i][j] = it.now.J[i][j];
  }
  iterate<Real>(problem, R, settings, it, progress);
  progress.refuse(hn::AndNot(it.moved, hn::Ne(it.last_failure, accepted)), it.last_failure);
  hn::StoreU(hn::IfThenElseZero(progress.alive, it.now.cost), tag, outcomes.map_cost + lane);
  progress.refuse(hn::Not(hn::Le(it.now.cost, hn::Set(tag, static_cast<Real>(settings.gate)))),
                  number<Real>(UpdateStatus::kRejectedByGate));

  const bool at_final = settings.covariance == CovarianceLinearisation::kFinalIterate;
  const V(*J)[3] = at_final ? it.now.J : it.J_before;
  if (!at_final) predicted_covariance<Real>(J, problem.S, it.G);
  whiten(it.G);
  // U = M J^T L^-T, so that U U^T = M J^T (J S J^T + R)^-1 J M^T.
  V K[3][2];
  for (int j = 0; j < 3; ++j) whitening.apply(J[0][j], J[1][j], K[j][0], K[j][1]);
  commit<Real>(group, task, lane, it.lambda, K, progress);
  tell_outcomes<Real>(task.considered, lane, progress.status, it.count, outcomes);
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
