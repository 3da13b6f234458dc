#include "core/calibration/timed_poses.hpp"

#include <algorithm>
#include <utility>

#include "core/statistics/upper_median.hpp"

namespace perimap {

std::vector<TimedPose> in_order(std::vector<TimedPose> poses) {
  std::stable_sort(poses.begin(), poses.end(), [](const TimedPose& a, const TimedPose& b) { return a.t_s < b.t_s; });
  const auto same_time = [](const TimedPose& a, const TimedPose& b) { return a.t_s == b.t_s; };
  poses.erase(std::unique(poses.begin(), poses.end(), same_time), poses.end());
  return poses;
}

double median_interval_s(const std::vector<TimedPose>& poses) {
  if (poses.size() < 2) return 0.0;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < poses.size(); ++i) intervals.push_back(poses[i].t_s - poses[i - 1].t_s);
  return upper_median(intervals.begin(), intervals.end());
}

double longest_gap_s(const std::vector<TimedPose>& poses) { return std::max(0.1, 3.0 * median_interval_s(poses)); }

std::optional<PoseWithTwist> pose_at(const std::vector<TimedPose>& poses, double t_s, double longest_gap_s) {
  const auto after =
      std::lower_bound(poses.begin(), poses.end(), t_s, [](const TimedPose& p, double t) { return p.t_s < t; });
  if (after == poses.end() || (after == poses.begin() && after->t_s > t_s) || poses.size() < 2) return std::nullopt;
  const auto second = after == poses.begin() ? after + 1 : after;
  const auto first = second - 1;
  const double gap_s = second->t_s - first->t_s;
  const double s = (t_s - first->t_s) / gap_s;
  const bool at_a_sample = s == 0.0 || s == 1.0;
  if (gap_s > longest_gap_s && !at_a_sample) return std::nullopt;
  PoseWithTwist result;
  result.X = interpolate(first->X, second->X, s);
  if (gap_s <= longest_gap_s) {
    result.twist.head<3>() = so3_log(first->X.R.transpose() * second->X.R) / gap_s;
    result.twist.tail<3>() = result.X.R.transpose() * (second->X.t - first->X.t) / gap_s;
  }
  return result;
}

std::vector<TimedPose> in_frame_of(const std::vector<TimedPose>& tool, const std::vector<TimedPose>& poses) {
  const double gap_s = longest_gap_s(tool);
  std::vector<TimedPose> relative;
  for (const TimedPose& pose : poses) {
    if (const auto at = pose_at(tool, pose.t_s, gap_s)) relative.push_back({pose.t_s, at->X.inverse() * pose.X});
  }
  return relative;
}

}  // namespace perimap
