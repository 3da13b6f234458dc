#include "core/calibration/held_stretches.hpp"

#include <algorithm>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

constexpr double kSame_rad = 3.0 * kDegree;
constexpr std::size_t kAlikeInARow = 3;

}  // namespace

Matrix3d orientation_of_notch(double notch_rad) { return so3_exp(Vector3d(0.0, 0.0, notch_rad)); }

double angle_between(const Matrix3d& a, const Matrix3d& b) { return so3_log(a.transpose() * b).norm(); }

void HeldStretches::add(const TimedTurn& reading) {
  held_ = !stretches_.empty() && angle_between(stretches_.back().R, reading.R) <= kSame_rad;
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
  const bool alike = std::all_of(others_.begin(), others_.end(), [&](const TimedTurn& other) {
    return angle_between(other.R, others_.front().R) <= kSame_rad;
  });
  if (alike && others_.size() == kAlikeInARow) begin();
}

void HeldStretches::begin() {
  stretches_.push_back({others_.front().t_s, others_.back().t_s, others_[kAlikeInARow / 2].R});
  readings_ = static_cast<double>(others_.size());
  others_.clear();
  held_ = true;
}

}  // namespace perimap
