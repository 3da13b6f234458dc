#include "core/surface/evidence_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace perimap {
namespace {

// In units of the spacing. Beyond the last features the organ may turn away, and nothing tells. In a lattice no place
// is further than 0.6 from a point of it.
constexpr double kReach = 1.5;
constexpr double kMargin = 1.0;
constexpr double kEdge = 0.25;

double third_nearest(std::span<const Vector2d> places, const Vector2d& s) {
  std::array<double, 4> nearest{};  // itself too
  nearest.fill(std::numeric_limits<double>::infinity());
  for (const Vector2d& place : places) {
    const double d2 = (place - s).squaredNorm();
    if (d2 >= nearest.back()) continue;
    nearest.back() = d2;
    std::sort(nearest.begin(), nearest.end());
  }
  const auto last = std::find_if(nearest.rbegin(), nearest.rend(), [](double d2) { return std::isfinite(d2); });
  return std::sqrt(*last);
}

// Whether a half-plane whose border goes through the origin holds none of the directions (rad).
bool lie_on_one_side(std::vector<double>& directions) {
  if (directions.empty()) return true;
  std::sort(directions.begin(), directions.end());
  double gap = directions.front() + 2.0 * std::numbers::pi - directions.back();
  for (std::size_t i = 1; i < directions.size(); ++i) gap = std::max(gap, directions[i] - directions[i - 1]);
  return gap > std::numbers::pi;
}

}  // namespace

EvidenceSupport::EvidenceSupport(std::vector<Vector2d> places) : places_(std::move(places)) {
  std::vector<double> distances;
  distances.reserve(places_.size());
  for (const Vector2d& place : places_) distances.push_back(third_nearest(places_, place));
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  // The middle distance of the third nearest.
  const double spacing_mm = *middle;
  reach_mm_ = std::clamp(kReach * spacing_mm, 8.0, 20.0);
  margin_mm_ = std::clamp(kMargin * spacing_mm, 1.0, 8.0);
  edge_mm_ = std::clamp(kEdge * spacing_mm, 1.0, 3.0);
}

double EvidenceSupport::nearest_mm(const Vector2d& s) const {
  double nearest2 = std::numeric_limits<double>::infinity();
  for (const Vector2d& place : places_) nearest2 = std::min(nearest2, (place - s).squaredNorm());
  return std::sqrt(nearest2);
}

// All that are about it lie on one side of it.
bool EvidenceSupport::is_beyond(const Vector2d& s) const {
  std::vector<double> directions;
  const double around_mm = 2.0 * reach_mm_;
  for (const Vector2d& place : places_) {
    const Vector2d d = place - s;
    if (d.squaredNorm() <= around_mm * around_mm) directions.push_back(std::atan2(d.y(), d.x()));
  }
  return lie_on_one_side(directions);
}

Support EvidenceSupport::at(const Vector2d& s) const {
  const double nearest = nearest_mm(s);
  if (!(nearest <= reach_mm_)) return Support::kTooFar;
  return nearest > margin_mm_ && is_beyond(s) ? Support::kBeyondEdge : Support::kSupported;
}

double EvidenceSupport::beyond_mm(const Vector2d& s) const {
  const double nearest = nearest_mm(s);
  return nearest > edge_mm_ && is_beyond(s) ? nearest : 0.0;
}

}  // namespace perimap
