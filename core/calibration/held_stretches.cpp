#include "core/calibration/held_stretches.hpp"

#include <algorithm>
#include <cstddef>

#include "core/angle/angle.hpp"
#include "core/calibration/turned_scope.hpp"

namespace perimap {
namespace {

constexpr double kSame_rad = 3.0 * kDegree;
constexpr std::size_t kAlikeInARow = 3;

bool are_alike(const TimedTurn& a, const TimedTurn& b) {
  return is_same_turn(a.R, b.R) && is_same_zoom(a.radius_px, b.radius_px);
}

}  // namespace

double radius_of_turns_px(const std::vector<HeldStretch>& stretches) {
  if (stretches.empty()) return 0.0;
  const auto first = std::find_if(stretches.begin(), stretches.end(),
                                  [](const HeldStretch& s) { return s.to_s - s.from_s >= kLeastHeld_s; });
  return (first == stretches.end() ? stretches.back() : *first).radius_px;
}

Matrix3d orientation_of_notch(double notch_rad) { return so3_exp(Vector3d(0.0, 0.0, notch_rad)); }

double angle_between(const Matrix3d& a, const Matrix3d& b) { return so3_log(a.transpose() * b).norm(); }

bool is_same_turn(const Matrix3d& a, const Matrix3d& b) { return angle_between(a, b) <= kSame_rad; }

void HeldStretches::add(const TimedTurn& reading) {
  held_ = open_ && are_alike({0.0, stretches_.back().R, stretches_.back().radius_px}, reading);
  if (held_) {
    HeldStretch& stretch = stretches_.back();
    readings_ += 1.0;
    stretch.R = stretch.R * so3_exp(so3_log(stretch.R.transpose() * reading.R) / readings_);
    stretch.radius_px += (reading.radius_px - stretch.radius_px) / readings_;
    stretch.to_s = reading.t_s;
    others_.clear();
    return;
  }
  others_.push_back(reading);
  if (others_.size() > kAlikeInARow) others_.erase(others_.begin());
  if (others_.size() < kAlikeInARow) return;
  open_ = false;
  const bool alike = std::all_of(others_.begin(), others_.end(),
                                 [&](const TimedTurn& other) { return are_alike(other, others_.front()); });
  if (alike) begin();
}

void HeldStretches::begin() {
  stretches_.push_back(
      {others_.front().t_s, others_.back().t_s, others_[kAlikeInARow / 2].R, others_[kAlikeInARow / 2].radius_px});
  readings_ = static_cast<double>(others_.size());
  others_.clear();
  open_ = true;
  held_ = true;
}

}  // namespace perimap
