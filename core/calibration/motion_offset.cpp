#include "core/calibration/motion_offset.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/calibration/felt_in_sensor.hpp"
#include "core/calibration/variance_of_sum.hpp"

namespace perimap {
namespace {

// Of one pose, whitened: how it feels the places of board and camera, the sensor's twist, its error.
using PoseRows = Eigen::Matrix<double, 6, 14>;
constexpr int kPlaceColumns = 12;
constexpr int kTwistColumn = 12;
constexpr int kErrorColumn = 13;

struct FastRows {
  Eigen::MatrixXd rows;   // six of each pose
  double kept_share = 1;  // of the variance of errors that are new in each pose
};

// Each less the mean of those at most half a window away.
FastRows without_slow(const std::vector<PoseRows>& values, const std::vector<double>& times_s, double window_s) {
  FastRows fast;
  fast.rows.resize(static_cast<Eigen::Index>(6 * values.size()), PoseRows::ColsAtCompileTime);
  fast.kept_share = 0.0;
  std::size_t begin = 0;
  std::size_t end = 0;
  PoseRows sum = PoseRows::Zero();
  for (std::size_t i = 0; i < values.size(); ++i) {
    while (end < values.size() && times_s[end] <= times_s[i] + 0.5 * window_s) sum += values[end++];
    while (times_s[begin] < times_s[i] - 0.5 * window_s) sum -= values[begin++];
    const auto count = static_cast<double>(end - begin);
    fast.rows.middleRows<6>(static_cast<Eigen::Index>(6 * i)) = values[i] - sum / count;
    fast.kept_share += (1.0 - 1.0 / count) / static_cast<double>(values.size());
  }
  return fast;
}

}  // namespace

std::optional<MotionOffset> offset_by_motion(const std::vector<PosePair>& pairs, const std::vector<Vector6d>& errors,
                                             const std::vector<char>& used,
                                             const Eigen::Matrix<double, 6, 6>& error_covariance, double window_s) {
  constexpr std::size_t kFewest = 20;
  const Eigen::Matrix<double, 6, 6> root = error_covariance.llt().matrixL();
  std::vector<double> times_s;
  std::vector<PoseRows> poses;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (used[i] == 0) continue;
    times_s.push_back(pairs[i].t_s);
    PoseRows rows;
    rows << felt_in_sensor(pairs[i].X_WS, pairs.front().X_WS.t), pairs[i].twist_S, errors[i];
    poses.emplace_back(root.triangularView<Eigen::Lower>().solve(rows));
  }
  if (times_s.size() < kFewest) return std::nullopt;
  const FastRows fast = without_slow(poses, times_s, window_s);
  if (!(fast.kept_share > 0.0)) return std::nullopt;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> places;
  // Where the camera is shows in no pose more than in the next: without its mean nothing is left of it but rounding.
  constexpr double kRounding = 1e-9;
  places.setThreshold(kRounding);
  places.compute(fast.rows.leftCols<kPlaceColumns>());
  const auto beyond_places = [&](int column) {
    const Eigen::VectorXd all = fast.rows.col(column);
    return Eigen::VectorXd(all - fast.rows.leftCols<kPlaceColumns>() * places.solve(all));
  };
  const Eigen::VectorXd twist = beyond_places(kTwistColumn);
  const Eigen::VectorXd error = beyond_places(kErrorColumn);
  const double H = twist.squaredNorm();
  if (!(H > 0.0)) return std::nullopt;
  MotionOffset result;
  result.change_s = -twist.dot(error) / H;
  std::vector<double> scores;
  // Never less than of white errors, neither as they are where it moves nor as they are everywhere: of several windows
  // the one whose deviation came out smallest by chance would be taken for the surest.
  double alone = 0.0;
  for (Eigen::Index row = 0; row < twist.size(); row += 6) {
    const auto along = twist.segment<6>(row);
    scores.push_back(along.dot(error.segment<6>(row) + result.change_s * along));
    alone += scores.back() * scores.back() / fast.kept_share;
  }
  const double everywhere =
      H * (error + result.change_s * twist).squaredNorm() / static_cast<double>(error.size()) / fast.kept_share;
  result.deviation_s = std::sqrt(std::max({alone, everywhere, variance_of_sum(scores)})) / H;
  return result;
}

}  // namespace perimap
