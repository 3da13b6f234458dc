#include "core/calibration/brisk_speed.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace perimap {
namespace {

constexpr double kAround_s = 0.25;

// Each less the mean of those at most so far away.
std::vector<Vector3d> less_the_slow_part(const std::vector<Vector3d>& speeds, const std::vector<double>& times_s) {
  std::vector<Vector3d> fast;
  std::size_t begin = 0;
  std::size_t end = 0;
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    while (end < speeds.size() && times_s[end] <= times_s[i] + kAround_s) sum += speeds[end++];
    while (times_s[begin] < times_s[i] - kAround_s) sum -= speeds[begin++];
    fast.emplace_back(speeds[i] - sum / static_cast<double>(end - begin));
  }
  return fast;
}

}  // namespace

double brisk_speed(const std::vector<PosePair>& pairs, const Matrix3d& R_SC) {
  constexpr double kLongest_s = 0.3;  // between the poses before and after
  std::vector<double> times_s;
  std::vector<Vector3d> of_camera;
  std::vector<Vector3d> of_tracker;
  for (std::size_t i = 1; i + 1 < pairs.size(); ++i) {
    const PosePair& before = pairs[i - 1];
    const PosePair& after = pairs[i + 1];
    const double dt = after.t_s - before.t_s;
    if (!(dt > 0.0 && dt < kLongest_s)) continue;
    times_s.push_back(pairs[i].t_s);
    of_camera.emplace_back(so3_log(before.X_BC.R.transpose() * after.X_BC.R) / dt);
    of_tracker.emplace_back(R_SC.transpose() * so3_log(before.X_WS.R.transpose() * after.X_WS.R) / dt);
  }
  if (times_s.empty()) return 0.0;
  const std::vector<Vector3d> camera = less_the_slow_part(of_camera, times_s);
  const std::vector<Vector3d> tracker = less_the_slow_part(of_tracker, times_s);
  std::vector<double> products;
  for (std::size_t i = 0; i < camera.size(); ++i) products.push_back(camera[i].dot(tracker[i]));
  // A board that is seen the wrong way round turns at once: the largest hundredth does not count.
  std::sort(products.begin(), products.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  products.resize(products.size() - products.size() / 100);
  double sum = 0.0;
  for (const double product : products) sum += product / static_cast<double>(products.size());
  return std::sqrt(std::max(0.0, sum));
}

}  // namespace perimap
