#include "core/pipeline/patient_tool.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/geometry/nearest_rotation.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// The longest window of a displacement, and what is taken off before it.
constexpr Duration kHomeAge = milliseconds(8500);
constexpr Duration kHomeLength = seconds(4);
constexpr Duration kLeastHome = seconds(2);
constexpr Duration kHomeEvery = milliseconds(500);
// How rigidly the tool goes with the organ, per axis.
constexpr double kHeld_mm = 0.3;
constexpr double kHeld_rad = 0.005;
constexpr double kLeastShare = 0.6;
constexpr double kFewestReadings = 5.0;

std::int64_t number_of(Instant t, Duration bin) noexcept { return t.time_since_epoch() / bin; }

// Variance of the mean of n readings over T s, over that of one: white errors, or ones that fall to 1/e within tau.
double variance_of_mean(double n, double T, double tau) noexcept {
  if (!(tau > 0.0)) return 1.0 / n;
  const double share = tau / T;
  return std::max(1.0 / n, 2.0 * share * (1.0 - share * (1.0 - std::exp(-1.0 / share))));
}

}  // namespace

void PatientTool::add(const TrackerSample& sample) noexcept {
  const bool valid = sample.state == ToolState::kOk && sample.X_WS.t.allFinite() && sample.X_WS.R.allFinite();
  // Of a tracker that is said to be exact, as in a simulation, what keeps still is read so.
  const bool noisy = tracker_.position_deviation_mm > 0.0;
  const bool repeated = noisy && valid && last_ && last_->t == sample.X_WS.t && last_->R == sample.X_WS.R;
  last_ = valid ? std::optional(sample.X_WS) : std::nullopt;
  if (!valid || repeated || sample.source_time.time_since_epoch() < Duration(0)) return;
  const Instant time = sample.source_time + tracker_.time_offset;
  const std::int64_t number = number_of(time, kBin);
  Bin& bin = bins_[static_cast<std::uint64_t>(number) % kBins];
  if (bin.number > number) return;  // its place is taken by what is newer
  if (bin.number != number) bin = {.number = number};
  const double deviation_mm = tracker_.position_deviation_mm;
  bin.readings += 1.0;
  bin.position_variance_mm2 += std::max(deviation_mm * deviation_mm, sample.error_mm * sample.error_mm / 3.0);
  bin.t += sample.X_WS.t;
  bin.R += sample.X_WS.R;
  newest_ = std::max(newest_, time);
}

std::optional<PatientTool::Mean> PatientTool::mean(Instant from, Instant until) const noexcept {
  Bin sum;
  double bins = 0.0;
  const std::int64_t last = number_of(until, kBin);
  const std::int64_t first = std::max(number_of(from, kBin), last - static_cast<std::int64_t>(kBins) + 1);
  for (std::int64_t number = std::max<std::int64_t>(first, 0); number <= last; ++number) {
    const Bin& bin = bins_[static_cast<std::uint64_t>(number) % kBins];
    if (bin.number != number) continue;
    bins += 1.0;
    sum.readings += bin.readings;
    sum.position_variance_mm2 += bin.position_variance_mm2;
    sum.t += bin.t;
    sum.R += bin.R;
  }
  const double length_s = to_seconds(until - from);
  if (sum.readings < kFewestReadings || bins * to_seconds(kBin) < kLeastShare * length_s) return std::nullopt;
  const double share = variance_of_mean(sum.readings, length_s, to_seconds(tracker_.error_correlation));
  const double turn_rad = tracker_.rotation_deviation_rad;
  return Mean{{nearest_rotation(sum.R), sum.t / sum.readings},
              share * sum.position_variance_mm2 / sum.readings,
              share * turn_rad * turn_rad};
}

void PatientTool::heed_organ(bool at_its_place, Instant now) noexcept {
  if (!at_its_place) {
    at_its_place_since_.reset();
    return;
  }
  // The first map was learnt where the tool has been since before there was a map.
  if (!at_its_place_since_) at_its_place_since_ = home_ ? now : Instant{};
  if (home_ && now - asked_ < kHomeEvery) return;
  asked_ = now;
  const Instant until = now - kHomeAge;
  const Instant from = std::max(until - kHomeLength, *at_its_place_since_);
  if (until - from < kLeastHome) return;
  if (const auto home = mean(from, until)) home_ = home;
}

void PatientTool::move_home() noexcept {
  home_ = mean(newest_ - seconds(2), newest_);
  // Where it was before tells nothing of the map any more.
  if (!home_) bins_ = {};
  at_its_place_since_.reset();
}

void PatientTool::forget() noexcept {
  home_.reset();
  bins_ = {};
  at_its_place_since_.reset();
}

ToolMovement PatientTool::moved(Duration window, Instant now, const Vector3d& about_W_mm) const noexcept {
  ToolMovement movement;
  if (!home_) return movement;
  const std::optional<Mean> there = mean(now - window, now);
  if (!there) return movement;
  const Pose X = there->X_WO * home_->X_WO.inverse();
  movement.told = true;
  movement.d << so3_log(X.R), X * about_W_mm - about_W_mm;
  // An error of its orientation moves the point by its lever.
  const Matrix3d lever = -cross_matrix(about_W_mm - there->X_WO.t);
  const double turn_rad2 = there->rotation_variance_rad2 + home_->rotation_variance_rad2 + kHeld_rad * kHeld_rad;
  const double shift_mm2 = there->position_variance_mm2 + home_->position_variance_mm2 + kHeld_mm * kHeld_mm;
  movement.covariance.topLeftCorner<3, 3>() = turn_rad2 * Matrix3d::Identity();
  movement.covariance.bottomLeftCorner<3, 3>() = turn_rad2 * lever;
  movement.covariance.topRightCorner<3, 3>() = turn_rad2 * lever.transpose();
  movement.covariance.bottomRightCorner<3, 3>() =
      turn_rad2 * lever * lever.transpose() + shift_mm2 * Matrix3d::Identity();
  return movement;
}

}  // namespace perimap
