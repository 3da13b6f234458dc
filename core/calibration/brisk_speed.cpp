#include "core/calibration/brisk_speed.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace perimap {

double brisk_speed(const std::vector<TimedPose>& poses) {
  constexpr double kHalf_s = 0.25;
  constexpr double kLongest_s = 0.3;  // between the poses before and after
  std::vector<double> times_s;
  std::vector<Vector3d> speeds;
  for (std::size_t i = 1; i + 1 < poses.size(); ++i) {
    const double dt = poses[i + 1].t_s - poses[i - 1].t_s;
    if (!(dt > 0.0 && dt < kLongest_s)) continue;
    times_s.push_back(poses[i].t_s);
    speeds.emplace_back(so3_log(poses[i - 1].X.R.transpose() * poses[i + 1].X.R) / dt);
  }
  std::size_t begin = 0;
  std::size_t end = 0;
  Vector3d sum = Vector3d::Zero();
  std::vector<double> squares;
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    while (end < speeds.size() && times_s[end] <= times_s[i] + kHalf_s) sum += speeds[end++];
    while (times_s[begin] < times_s[i] - kHalf_s) sum -= speeds[begin++];
    squares.push_back((speeds[i] - sum / static_cast<double>(end - begin)).squaredNorm());
  }
  if (squares.empty()) return 0.0;
  // A board that is seen the wrong way round turns at once: the fastest hundredth does not count.
  std::sort(squares.begin(), squares.end());
  squares.resize(squares.size() - squares.size() / 100);
  double all = 0.0;
  for (const double square : squares) all += square / static_cast<double>(squares.size());
  return std::sqrt(all);
}

}  // namespace perimap
