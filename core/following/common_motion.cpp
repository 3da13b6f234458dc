#include "core/following/common_motion.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/statistics/nearest_few.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr std::size_t kAround = 6;
using Offs = NearestFew<Vector2d, kAround>;

// On each axis.
Vector2d median_off(const Offs& offs) noexcept {
  Vector2d median;
  std::array<double, kAround> values{};
  for (int axis = 0; axis < 2; ++axis) {
    for (std::size_t i = 0; i < offs.size(); ++i) values[i] = offs[i].value[axis];
    median[axis] = upper_median(values.begin(), values.begin() + offs.size());
  }
  return median;
}

}  // namespace

CommonMotion::CommonMotion(std::size_t most) { pairs_.reserve(most); }

void CommonMotion::add(const Vector2d& from_px, const Vector2d& to_px) noexcept {
  if (pairs_.size() < pairs_.capacity()) pairs_.push_back({from_px, to_px, false});
}

void CommonMotion::begin_with(const Vector2d& displacement_px) noexcept {
  clear();
  shape_.setIdentity();
  from_px_.setZero();
  to_px_ = displacement_px;
}

std::size_t CommonMotion::count(const Similarity& motion, double tolerance_px) const noexcept {
  return static_cast<std::size_t>(std::count_if(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
    return (motion.shape * pair.from + motion.offset_px - pair.to).squaredNorm() <= tolerance_px * tolerance_px;
  }));
}

// By all pairs of two pairs, each of which determines a similarity; of many pairs, by a share of them.
std::size_t CommonMotion::agree(double tolerance_px) noexcept {
  constexpr std::size_t kMostTried = 40;
  constexpr double kLeastApart = 8;  // of the tolerance
  constexpr double kMostTurn_rad = 0.5, kMostScale = 1.5;
  const std::size_t stride = (pairs_.size() + kMostTried - 1) / kMostTried;
  Similarity best;
  std::size_t most = 0;
  for (std::size_t i = 0; i < pairs_.size(); i += stride) {
    for (std::size_t k = i + stride; k < pairs_.size(); k += stride) {
      const Vector2d before = pairs_[k].from - pairs_[i].from, after = pairs_[k].to - pairs_[i].to;
      if (before.norm() < kLeastApart * tolerance_px) continue;
      const double along = before.dot(after) / before.squaredNorm();
      const double across = (before.x() * after.y() - before.y() * after.x()) / before.squaredNorm();
      const double scale = std::hypot(along, across);
      if (scale > kMostScale || scale * kMostScale < 1 || std::abs(std::atan2(across, along)) > kMostTurn_rad) continue;
      Similarity motion;
      motion.shape << along, -across, across, along;
      motion.offset_px = 0.5 * (pairs_[i].to + pairs_[k].to - motion.shape * (pairs_[i].from + pairs_[k].from));
      const std::size_t alike = count(motion, tolerance_px);
      if (alike <= most) continue;
      most = alike;
      best = motion;
    }
  }
  if (most >= kFewest) fit(best, tolerance_px);
  return most;
}

// Affine, by least squares over those that agree. What they do not determine stays as the similarity has it.
void CommonMotion::fit(const Similarity& motion, double tolerance_px) noexcept {
  from_px_.setZero();
  Vector2d off_px = Vector2d::Zero();
  double agreeing = 0;
  for (Pair& pair : pairs_) {
    const Vector2d off = pair.to - motion.shape * pair.from - motion.offset_px;
    pair.agrees = off.squaredNorm() <= tolerance_px * tolerance_px;
    if (!pair.agrees) continue;
    from_px_ += pair.from;
    off_px += off;
    ++agreeing;
  }
  from_px_ /= agreeing;
  off_px /= agreeing;
  to_px_ = motion.shape * from_px_ + motion.offset_px + off_px;
  // As if each had been seen to go with the similarity as well, over this distance.
  constexpr double kOver_px = 20;
  Matrix2d normal = agreeing * kOver_px * kOver_px * Matrix2d::Identity(), right = Matrix2d::Zero();
  for (const Pair& pair : pairs_) {
    if (!pair.agrees) continue;
    const Vector2d from = pair.from - from_px_;
    normal += from * from.transpose();
    right += from * (pair.to - to_px_ - motion.shape * from).transpose();
  }
  shape_ = motion.shape + normal.ldlt().solve(right).transpose();
}

template <class Nearest>
Nearest CommonMotion::offs_around(const Vector2d& from_px, const Vector2d* but, bool agreeing) const noexcept {
  Nearest nearest;
  for (const Pair& pair : pairs_) {
    if ((agreeing && !pair.agrees) || (but != nullptr && pair.from == *but)) continue;
    const double distance_squared = (pair.from - from_px).squaredNorm();
    if (!nearest.takes(distance_squared)) continue;
    nearest.add(distance_squared, pair.to - to_px_ - shape_ * (pair.from - from_px_));
  }
  return nearest;
}

Vector2d CommonMotion::at(const Vector2d& from_px, const Vector2d* but) const noexcept {
  constexpr std::size_t kEnough = 4;
  const Offs offs = offs_around<Offs>(from_px, but, true);
  const Vector2d at = to_px_ + shape_ * (from_px - from_px_);
  return offs.size() < kEnough ? at : Vector2d(at + median_off(offs));
}

std::optional<Vector2d> CommonMotion::beside(const Vector2d& from_px, double tolerance_px,
                                             const Vector2d* but) const noexcept {
  constexpr std::ptrdiff_t kEnoughAlike = 4;
  const Offs offs = offs_around<Offs>(from_px, but, false);
  if (offs.size() < kAround) return std::nullopt;
  const Vector2d off = median_off(offs);
  std::ptrdiff_t alike = 0;
  for (std::size_t i = 0; i < kAround; ++i) alike += (offs[i].value - off).norm() <= tolerance_px ? 1 : 0;
  if (alike < kEnoughAlike) return std::nullopt;
  return to_px_ + shape_ * (from_px - from_px_) + off;
}

bool CommonMotion::holds_around(const Vector2d& from_px) const noexcept {
  constexpr std::ptrdiff_t kMostOthers = 1;
  NearestFew<bool, kAround> agree;
  for (const Pair& pair : pairs_) {
    const double distance_squared = (pair.from - from_px).squaredNorm();
    if (agree.takes(distance_squared)) agree.add(distance_squared, pair.agrees);
  }
  const auto others = std::count_if(agree.begin(), agree.end(), [](const auto& near) { return !near.value; });
  return agree.size() == kAround && others <= kMostOthers;
}

}  // namespace perimap
