#include "core/calibration/dwells.hpp"

#include <algorithm>
#include <cmath>

#include "core/calibration/residual_correlation.hpp"

namespace perimap {
namespace {

constexpr double kAveraged_s = 0.25;
constexpr double kGap_s = 0.5;

// Each point's mean with those within half the time before and after.
std::vector<Vector3d> averaged(const std::vector<TimedPoint>& points) {
  std::vector<Vector3d> smooth;
  std::size_t begin = 0;
  std::size_t end = 0;
  Vector3d sum = Vector3d::Zero();
  for (const TimedPoint& point : points) {
    while (end < points.size() && points[end].t_s <= point.t_s + 0.5 * kAveraged_s) sum += points[end++].p;
    while (points[begin].t_s < point.t_s - 0.5 * kAveraged_s) sum -= points[begin++].p;
    smooth.emplace_back(sum / static_cast<double>(end - begin));
  }
  return smooth;
}

Dwell dwell_of(const std::vector<TimedPoint>& points, std::size_t begin, std::size_t end) {
  Dwell dwell;
  dwell.begin_s = points[begin].t_s;
  dwell.end_s = points[end - 1].t_s;
  const double margin_s = std::min(0.3, 0.2 * (dwell.end_s - dwell.begin_s));
  while (begin < end && points[begin].t_s < dwell.begin_s + margin_s) ++begin;
  while (end > begin + 1 && points[end - 1].t_s > dwell.end_s - margin_s) --end;
  const auto n = static_cast<double>(end - begin);
  for (std::size_t i = begin; i < end; ++i) dwell.p += points[i].p / n;
  double variance = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> residuals;
    for (std::size_t i = begin; i < end; ++i) residuals.push_back((points[i].p - dwell.p)[axis]);
    double squares = 0.0;
    for (const double r : residuals) squares += r * r;
    variance += correlation_length(residuals) * squares / std::max(1.0, n - 1.0) / n;
  }
  dwell.deviation_mm = std::sqrt(variance);
  dwell.points = end - begin;
  return dwell;
}

}  // namespace

std::vector<Dwell> find_dwells(const std::vector<TimedPoint>& points, double shortest_s, double radius_mm) {
  const std::vector<Vector3d> smooth = averaged(points);
  std::vector<Dwell> dwells;
  std::size_t begin = 0;
  while (begin < points.size()) {
    std::size_t end = begin + 1;
    Vector3d mean = smooth[begin];
    while (end < points.size() && points[end].t_s - points[end - 1].t_s < kGap_s &&
           (smooth[end] - mean).norm() <= radius_mm) {
      mean += (smooth[end] - mean) / static_cast<double>(end - begin + 1);
      ++end;
    }
    if (points[end - 1].t_s - points[begin].t_s >= shortest_s) {
      dwells.push_back(dwell_of(points, begin, end));
      begin = end;
    } else {
      ++begin;
    }
  }
  return dwells;
}

}  // namespace perimap
