#include "core/tool/tip_track.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace perimap {
namespace {

// Spectral densities of the acceleration, mm^2/s^3: of one that has a deviation of a and lasts for tau, 2 a^2 tau. At
// rest in a holder (10 mm/s^2, 0.1 s), on the beating heart or in a careful hand (150 mm/s^2 likewise), and as quick as
// a hand gets (2000 mm/s^2 for 0.05 s, the bound that the scope's pose is extrapolated with).
constexpr std::array<double, 3> kAccelerations_mm2_per_s3 = {20.0, 4500.0, 4e5};
// What a tool may do when it is first seen.
constexpr double kFirstVelocity_mm_per_s = 200.0;
// What a filter has foretold counts e times less after so long.
constexpr double kMemory_s = 0.5;
// No filter is ever out of the question: a hand that rests begins to move.
constexpr double kLeastLogWeight = -6.0;
// What readings leave of a tip even with a tracker that is said to be exact: its stamps, and rounding on the wire.
constexpr double kLeastNoise_mm = 0.02;

constexpr double square(double x) noexcept { return x * x; }

}  // namespace

// Of one reading, at the tip: the sensor's, and the lever times its rotation's.
Matrix3d TipTrack::noise_of(const TrackerSample& sample, const Vector3d& lever_W_mm) const noexcept {
  const double error_mm = sample.error_mm / std::numbers::sqrt3;
  const double deviation_mm = tracker_.position_deviation_mm;
  // Written so that a value that is not a number changes nothing. As PoseHistory has it.
  const bool worse = error_mm > deviation_mm;
  const double growth = worse && deviation_mm > 0.0 ? error_mm / deviation_mm : 1.0;
  const double position_mm2 = worse ? square(error_mm) : square(deviation_mm);
  const double rotation_rad2 = square(growth * tracker_.rotation_deviation_rad);
  return (position_mm2 + square(kLeastNoise_mm)) * Matrix3d::Identity() +
         rotation_rad2 * (lever_W_mm.squaredNorm() * Matrix3d::Identity() - lever_W_mm * lever_W_mm.transpose());
}

void TipTrack::add(const TrackerSample& sample) noexcept {
  const Instant stamp = sample.source_time + tracker_.time_offset;
  if (last_stamp_ && stamp <= *last_stamp_) return;
  const bool seen = sample.state == ToolState::kOk;
  if (seen && !(sample.X_WS.R.allFinite() && sample.X_WS.t.allFinite())) return;
  last_stamp_ = stamp;
  lost_sight_ = !seen;
  if (!seen) return;
  const bool exact = tracker_.position_deviation_mm == 0.0;
  if (last_seen_ && !exact && sample.X_WS.R == last_X_WO_.R && sample.X_WS.t == last_X_WO_.t) return;
  const Matrix3d noise_mm2 = noise_of(sample, sample.X_WS.R * tip_.p_OT_mm);
  const Vector3d tip_W_mm = sample.X_WS * tip_.p_OT_mm;
  if (!last_seen_ || stamp - *last_seen_ > kLongestGap) {
    begin(tip_W_mm, noise_mm2);
  } else {
    update(tip_W_mm, noise_mm2, to_seconds(stamp - *last_seen_));
  }
  last_seen_ = stamp;
  last_X_WO_ = sample.X_WS;
  last_noise_mm2_ = noise_mm2;
}

void TipTrack::begin(const Vector3d& tip_W_mm, const Matrix3d& noise_mm2) noexcept {
  for (Filter& filter : filters_) {
    filter = {};
    filter.x.head<3>() = tip_W_mm;
    filter.P.topLeftCorner<3, 3>() = noise_mm2;
    filter.P.bottomRightCorner<3, 3>() = square(kFirstVelocity_mm_per_s) * Matrix3d::Identity();
  }
}

void TipTrack::advance(Filter& filter, double acceleration_mm2_per_s3, double dt) noexcept {
  auto P_pp = filter.P.topLeftCorner<3, 3>();
  auto P_pv = filter.P.topRightCorner<3, 3>();
  auto P_vv = filter.P.bottomRightCorner<3, 3>();
  filter.x.head<3>() += dt * filter.x.tail<3>();
  const Matrix3d pv = P_pv;
  const Matrix3d vv = P_vv;
  const double q = acceleration_mm2_per_s3;
  P_pp += dt * (pv + pv.transpose()) + dt * dt * vv + q * dt * dt * dt / 3.0 * Matrix3d::Identity();
  P_pv += dt * vv + q * dt * dt / 2.0 * Matrix3d::Identity();
  filter.P.bottomLeftCorner<3, 3>() = P_pv.transpose();
  P_vv += q * dt * Matrix3d::Identity();
}

void TipTrack::update(const Vector3d& tip_W_mm, const Matrix3d& noise_mm2, double dt) noexcept {
  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kFilters; ++i) {
    Filter& f = filters_[i];
    advance(f, kAccelerations_mm2_per_s3[i], dt);
    const Vector3d innovation = tip_W_mm - f.x.head<3>();
    const Matrix3d S = f.P.topLeftCorner<3, 3>() + noise_mm2;
    const Eigen::LLT<Matrix3d> of_S(S);
    const Eigen::Matrix<double, 3, 6> gain = of_S.solve(f.P.topRows<3>());  // transposed
    f.x += gain.transpose() * innovation;
    f.P -= gain.transpose() * f.P.topRows<3>();
    f.P = (0.5 * (f.P + f.P.transpose())).eval();
    const double log_likelihood =
        -0.5 * innovation.dot(of_S.solve(innovation)) - of_S.matrixLLT().diagonal().array().abs().log().sum();
    f.log_weight = std::exp(-dt / kMemory_s) * f.log_weight + log_likelihood;
    largest = std::max(largest, f.log_weight);
  }
  for (Filter& f : filters_) f.log_weight = std::max(f.log_weight - largest, kLeastLogWeight);
}

std::optional<TipPrediction> TipTrack::at(Instant t) const noexcept {
  if (!last_seen_) return std::nullopt;
  const double dt = std::max(0.0, to_seconds(t - *last_seen_));
  std::array<Filter, kFilters> ahead = filters_;
  double sum = 0.0;
  State mean = State::Zero();
  for (std::size_t i = 0; i < kFilters; ++i) {
    advance(ahead[i], kAccelerations_mm2_per_s3[i], dt);
    const double weight = std::exp(ahead[i].log_weight);
    sum += weight;
    mean += weight * ahead[i].x;
  }
  mean /= sum;
  TipPrediction tip;
  tip.p_WT_mm = mean.head<3>();
  tip.velocity_W_mm_per_s = mean.tail<3>();
  for (const Filter& f : ahead) {
    const Vector3d off = f.x.head<3>() - tip.p_WT_mm;
    tip.covariance_W_mm2 += std::exp(f.log_weight) / sum * (f.P.topLeftCorner<3, 3>() + off * off.transpose());
  }
  // An error that lasts is in all readings alike, and no filter makes it less.
  if (tracker_.error_correlation > Duration(0)) tip.covariance_W_mm2 += last_noise_mm2_;
  tip.covariance_W_mm2 += last_X_WO_.R * tip_.covariance_O_mm2 * last_X_WO_.R.transpose();
  return tip;
}

}  // namespace perimap
