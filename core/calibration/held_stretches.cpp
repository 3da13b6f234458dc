#include "core/calibration/held_stretches.hpp"

#include <algorithm>
#include <cstddef>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

constexpr double kSame_rad = 3.0 * kDegree;
constexpr std::size_t kAlikeInARow = 3;

}  // namespace

Matrix3d orientation_of_notch(double notch_rad) { return so3_exp(Vector3d(0.0, 0.0, notch_rad)); }

double angle_between(const Matrix3d& a, const Matrix3d& b) { return so3_log(a.transpose() * b).norm(); }

bool is_same_turn(const Matrix3d& a, const Matrix3d& b) { return angle_between(a, b) <= kSame_rad; }

void HeldStretches::add(const TimedTurn& reading) {
  held_ = open_ && is_same_turn(stretches_.back().R, reading.R);
  if (held_) {
    HeldStretch& stretch = stretches_.back();
    readings_ += 1.0;
    stretch.R = stretch.R * so3_exp(so3_log(stretch.R.transpose() * reading.R) / readings_);
    stretch.to_s = reading.t_s;
    others_.clear();
    return;
  }
  others_.push_back(reading);
  if (others_.size() > kAlikeInARow) others_.erase(others_.begin());
  if (others_.size() < kAlikeInARow) return;
  open_ = false;
  const bool alike = std::all_of(others_.begin(), others_.end(),
                                 [&](const TimedTurn& other) { return is_same_turn(other.R, others_.front().R); });
  if (alike) begin();
}

void HeldStretches::begin() {
  stretches_.push_back({others_.front().t_s, others_.back().t_s, others_[kAlikeInARow / 2].R});
  readings_ = static_cast<double>(others_.size());
  others_.clear();
  open_ = true;
  held_ = true;
}

}  // namespace perimap
