#include "daemon/setup/hand_eye.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/angle/angle.hpp"
#include "core/calibration/brisk_speed.hpp"
#include "core/calibration/motion_offset.hpp"
#include "core/calibration/residual_correlation.hpp"
#include "core/calibration/rotation_spread.hpp"
#include "core/calibration/time_correlation.hpp"
#include "core/statistics/upper_median.hpp"
#include "daemon/setup/hand_eye_judgement.hpp"

namespace perimap {
namespace {

constexpr std::size_t kFewestPairs = 8;
constexpr double kFewestSpread_deg = 1.5;    // about the second axis
constexpr double kSlowestSequence_s = 0.25;  // between poses; beyond, they are taken one by one, at rest
constexpr double kOutlier = 30.0;            // of a chi-squared of six degrees of freedom: 4 in 100 000

double median_of(std::vector<double> values) {
  return values.empty() ? 0.0 : upper_median(values.begin(), values.end());
}

// Whether both were taken on and on, so that their motions can be laid over each other.
bool is_sequence(const std::vector<TimedPose>& poses) {
  return poses.size() >= 50 && median_interval_s(poses) <= kSlowestSequence_s;
}

std::string seconds_of(const std::vector<TimedPose>& poses) {
  return fmt::format("{:.3f} to {:.3f} s", poses.front().t_s, poses.back().t_s);
}

Expected<Correlation> correlate_motion(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& tracker,
                                       double largest_offset_s) {
  constexpr double kInterval_s = 0.01;
  constexpr double kShortestOverlap_s = 3.0;
  // Short spans tell times best, where the noise of the poses lets them: the shortest that correlates well.
  constexpr double kSpans_s[] = {0.15, 0.3, 0.6, 1.2};
  constexpr double kWell = 0.85;
  std::optional<Correlation> found;
  for (const double span_s : kSpans_s) {
    const auto speed = [&](const std::vector<TimedPose>& poses) {
      const double interval_s = median_interval_s(poses);
      return angular_speed(poses, kInterval_s, std::max(span_s, 2.0 * interval_s), longest_gap_s(poses));
    };
    const auto one = correlate(speed(camera), speed(tracker), largest_offset_s, kShortestOverlap_s, false);
    if (one && (!found || one->correlation > found->correlation)) found = one;
    if (found && found->correlation >= kWell) break;
  }
  if (!found) {
    return fail(fmt::format(
        "camera and tracker never overlap by {} s within {:.1f} s of clock offset (camera {}, tracker {}): give poses "
        "of the same minutes, on clocks that agree that far, or allow more with --largest-offset-s",
        kShortestOverlap_s, largest_offset_s, seconds_of(camera), seconds_of(tracker)));
  }
  constexpr double kLowest = 0.5;
  if (found->correlation < kLowest) {
    return fail(
        fmt::format("camera and tracker do not turn alike (correlation of their angular speeds at most {:.2f} within "
                    "{:.1f} s): are "
                    "they of the same minutes, is the sensor on this camera, and was the scope turned?",
                    found->correlation, largest_offset_s));
  }
  return *found;
}

// Over a tenth of a second, in which noise makes less of a motion than between two poses.
std::optional<Vector6d> twist_at(const std::vector<TimedPose>& tracker, double t_s, double gap_s) {
  constexpr double kHalf_s = 0.05;
  const auto before = pose_at(tracker, t_s - kHalf_s, gap_s);
  const auto after = pose_at(tracker, t_s + kHalf_s, gap_s);
  const auto at = pose_at(tracker, t_s, gap_s);
  if (!before || !at || !after) return std::nullopt;
  Vector6d twist;
  twist << so3_log(before->X.R.transpose() * after->X.R), at->X.R.transpose() * (after->X.t - before->X.t);
  return twist / (2.0 * kHalf_s);
}

// The tracker's pose at each of the camera's times.
std::vector<PosePair> pair_up(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& tracker,
                              double offset_s, bool one_by_one) {
  std::vector<PosePair> pairs;
  const double gap_s = longest_gap_s(tracker);
  const double nearest_s = 0.5 * median_interval_s(tracker);
  for (const TimedPose& seen : camera) {
    const double t_s = seen.t_s - offset_s;
    if (one_by_one && !is_sequence(tracker)) {
      const auto distance = [&](const TimedPose& pose) { return std::abs(pose.t_s - t_s); };
      const auto nearest =
          std::min_element(tracker.begin(), tracker.end(),
                           [&](const TimedPose& a, const TimedPose& b) { return distance(a) < distance(b); });
      if (nearest != tracker.end() && distance(*nearest) < nearest_s) {
        pairs.push_back({seen.t_s, nearest->X, seen.X, Vector6d::Zero()});
      }
    } else if (const auto at = pose_at(tracker, t_s, gap_s)) {
      pairs.push_back({seen.t_s, at->X, seen.X, twist_at(tracker, t_s, gap_s).value_or(at->twist)});
    }
  }
  return pairs;
}

// Row by row: what files of a robot's stops are, whose times say nothing. None unless both have as many.
std::vector<PosePair> pair_rows(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& tracker) {
  std::vector<PosePair> pairs;
  if (camera.size() != tracker.size()) return pairs;
  for (std::size_t i = 0; i < camera.size(); ++i) {
    pairs.push_back({camera[i].t_s, tracker[i].X, camera[i].X, Vector6d::Zero()});
  }
  return pairs;
}

// Covariance of the errors by their medians, rotation and translation each alike in all directions.
Matrix6d robust_covariance(const std::vector<Vector6d>& errors) {
  constexpr double kMedianOfChiSquared3 = 2.366;
  std::vector<double> rotation;
  std::vector<double> translation;
  for (const Vector6d& e : errors) {
    rotation.push_back(e.head<3>().squaredNorm());
    translation.push_back(e.tail<3>().squaredNorm());
  }
  Vector6d diagonal;
  diagonal << Vector3d::Constant(median_of(rotation) / kMedianOfChiSquared3 + 1e-12),
      Vector3d::Constant(median_of(translation) / kMedianOfChiSquared3 + 1e-9);
  return diagonal.asDiagonal();
}

// Of the errors used; of few drawn towards one that is alike in all directions, for it has 21 numbers.
Matrix6d covariance_of(const std::vector<Vector6d>& errors, const std::vector<char>& used) {
  constexpr double kParameters = 13.0;
  Matrix6d sum = Matrix6d::Zero();
  double n = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (used[i] == 0) continue;
    sum += errors[i] * errors[i].transpose(), n += 1.0;
  }
  const Matrix6d sample = sum / std::max(1.0, n - kParameters / 6.0);
  Vector6d diagonal;
  diagonal << Vector3d::Constant(sample.diagonal().head<3>().mean() + 1e-14),
      Vector3d::Constant(sample.diagonal().tail<3>().mean() + 1e-10);
  const double few = 21.0 / (21.0 + n);
  return few * Matrix6d(diagonal.asDiagonal()) + (1.0 - few) * sample;
}

std::vector<Vector6d> errors_of(const std::vector<PosePair>& pairs, const Pose& X_SC, const Pose& X_WB) {
  std::vector<Vector6d> errors;
  for (const PosePair& pair : pairs) errors.push_back(hand_eye_error(pair, X_SC, X_WB));
  return errors;
}

std::vector<char> within(const std::vector<Vector6d>& errors, const Matrix6d& covariance) {
  const Eigen::LLT<Matrix6d> llt(covariance);
  std::vector<char> used;
  for (const Vector6d& e : errors) used.push_back(e.dot(llt.solve(e)) <= kOutlier ? 1 : 0);
  return used;
}

std::size_t count_of(const std::vector<char>& used) {
  return static_cast<std::size_t>(std::count(used.begin(), used.end(), 1));
}

// Mean over the six whitened components.
double length_of(const std::vector<Vector6d>& errors, const std::vector<char>& used, const Matrix6d& covariance) {
  const Matrix6d whitening = Matrix6d(covariance.llt().matrixL()).inverse();
  double length = 0.0;
  for (int axis = 0; axis < 6; ++axis) {
    std::vector<double> along;
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (used[i] != 0) along.push_back((whitening * errors[i])[axis]);
    }
    length += correlation_length(along) / 6.0;
  }
  return length;
}

// The adjustment, offset and outliers in turn, until nothing changes.
Expected<void> adjust(HandEyeCalibration& result, const std::vector<TimedPose>& camera,
                      const std::vector<TimedPose>& tracker) {
  constexpr int kRounds = 12;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Vector6d> errors = errors_of(result.pairs, result.X_SC, result.X_WB);
    if (round == 0) result.error_covariance = robust_covariance(errors);
    result.used = within(errors, result.error_covariance);
    if (2 * count_of(result.used) < result.pairs.size()) {
      return fail(fmt::format(
          "only {} of {} poses agree with one place of the camera in the sensor: did the board, or the sensor on the "
          "scope, move? Are both files in the same unit of length (--unit)?",
          count_of(result.used), result.pairs.size()));
    }
    const HandEyeAdjustment adjusted = adjust_hand_eye(result.pairs, result.used, result.X_SC, result.X_WB,
                                                       result.error_covariance, result.offset_measured);
    if (!adjusted.converged) {
      return fail(
          "the motion does not determine the camera's place in the sensor: turn the scope about two axes and "
          "more, by 20 degrees and more, and record again");
    }
    const double change = (adjusted.X_SC.t - result.X_SC.t).norm() + std::abs(adjusted.offset_change_s) * 1e3;
    result.X_SC = adjusted.X_SC;
    result.X_WB = adjusted.X_WB;
    result.covariance = adjusted.covariance;
    if (result.offset_measured) {
      result.offset_s += adjusted.offset_change_s;
      result.pairs = pair_up(camera, tracker, result.offset_s, false);
    }
    errors = errors_of(result.pairs, result.X_SC, result.X_WB);
    result.used = within(errors, result.error_covariance);
    result.error_covariance = covariance_of(errors, result.used);
    result.correlation_length = length_of(errors, result.used, result.error_covariance);
    if (round > 2 && change < 1e-4) break;
  }
  result.covariance *= result.correlation_length;
  return {};
}

struct OffsetByWindow {
  double offset_s = 0.0;
  double deviation_s = 0.0;
  double white_deviation_s = 0.0;
};

// What is left when errors that last longer than each of these are passed over; the window as well.
std::vector<std::pair<double, OffsetByWindow>> offsets_by_window(const HandEyeCalibration& result) {
  constexpr double kWindows_s[] = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0};
  const std::vector<Vector6d> errors = errors_of(result.pairs, result.X_SC, result.X_WB);
  std::vector<std::pair<double, OffsetByWindow>> offsets;
  for (const double window_s : kWindows_s) {
    const auto told = offset_by_motion(result.pairs, errors, result.used, result.error_covariance, window_s);
    if (told)
      offsets.push_back({window_s, {result.offset_s + told->change_s, told->deviation_s, told->white_deviation_s}});
  }
  return offsets;
}

// Camera and tracker have errors that last (a lens, a board seen from one side), which the adjustment takes for noise
// and slow motions for time. The offset is what the fast motions tell, over the window that tells it best; where other
// windows tell as well and otherwise, the deviation says so.
Expected<void> refine_offset(HandEyeCalibration& result, const std::vector<TimedPose>& camera,
                             const std::vector<TimedPose>& tracker) {
  OffsetByWindow best{result.offset_s, std::sqrt(result.covariance(6, 6))};
  const auto better = [](const auto& a, const auto& b) { return a.second.deviation_s < b.second.deviation_s; };
  auto all = offsets_by_window(result);
  if (all.empty()) return {};
  const auto chosen = std::min_element(all.begin(), all.end(), better);
  const bool by_window = chosen->second.deviation_s < best.deviation_s;
  constexpr int kRounds = 10;
  for (int round = 0; by_window && round < kRounds; ++round) {
    const auto told = offset_by_motion(result.pairs, errors_of(result.pairs, result.X_SC, result.X_WB), result.used,
                                       result.error_covariance, chosen->first);
    if (!told) break;
    best = {result.offset_s + told->change_s, told->deviation_s, told->white_deviation_s};
    result.offset_s = best.offset_s;
    result.pairs = pair_up(camera, tracker, result.offset_s, false);
    result.used = within(errors_of(result.pairs, result.X_SC, result.X_WB), result.error_covariance);
    const HandEyeAdjustment adjusted =
        adjust_hand_eye(result.pairs, result.used, result.X_SC, result.X_WB, result.error_covariance, false);
    if (!adjusted.converged) return fail("the motion does not determine the camera's place in the sensor");
    result.X_SC = adjusted.X_SC;
    result.X_WB = adjusted.X_WB;
    if (std::abs(told->change_s) < 1e-5) break;
  }
  const HandEyeAdjustment together =
      adjust_hand_eye(result.pairs, result.used, result.X_SC, result.X_WB, result.error_covariance, true);
  if (!together.converged) return fail("the motion does not determine the clocks' offset: move faster");
  double systematic_s = 0.0;
  for (const auto& [window_s, told] : offsets_by_window(result)) {
    if (told.deviation_s > 1.5 * best.deviation_s) continue;
    const double by_chance_s = 3.0 * std::hypot(told.deviation_s, best.deviation_s);
    systematic_s = std::max(systematic_s, std::abs(told.offset_s - best.offset_s) - by_chance_s);
  }
  // Given the offset, the rest is as certain as before; and it goes with the offset.
  const Eigen::Matrix<double, 7, 7> joint = result.correlation_length * together.covariance;
  const Vector6d along = joint.topRightCorner<6, 1>() / joint(6, 6);
  // The surest of several windows is so by chance, too.
  const double deviation_s = std::max(best.deviation_s, best.white_deviation_s);
  const double variance = deviation_s * deviation_s + systematic_s * systematic_s;
  result.covariance = joint;
  result.covariance.topLeftCorner<6, 6>() += (variance - joint(6, 6)) * along * along.transpose();
  result.covariance.topRightCorner<6, 1>() = variance * along;
  result.covariance.bottomLeftCorner<1, 6>() = variance * along.transpose();
  result.covariance(6, 6) = variance;
  result.joint_offset_s = result.offset_s + together.offset_change_s;
  return {};
}

// Lengths that are off by a few hundredths fit nearly as well, with another place of the camera: they are refused, or
// what that place may be off is told as a deviation.
Expected<void> check_scale(HandEyeCalibration& result, const HandEyeSettings& settings) {
  result.scale = board_scale(result.pairs, result.used, result.X_SC, result.X_WB, result.error_covariance,
                             result.correlation_length, result.offset_measured);
  constexpr double kByChance = 3.0;
  constexpr double kSure = 5.0;
  const double off = std::abs(result.scale.ratio - 1.0);
  if (off > settings.largest_scale_error && off > kSure * result.scale.deviation) {
    return fail(fmt::format(
        "by the tracker the board is {:.3f} times as large as was said (standard deviation {:.3f}): measure its "
        "squares and say them with --square-mm; of tables, look at the unit of each; if both are right, the lens is "
        "not",
        result.scale.ratio, result.scale.deviation));
  }
  if (off > kByChance * result.scale.deviation) {
    const double share = 1.0 - kByChance * result.scale.deviation / off;
    const Vector6d untold = share * result.scale.change_C;
    result.covariance.topLeftCorner<6, 6>() += untold * untold.transpose();
  }
  return {};
}

std::string direction_of(const Vector3d& v) { return fmt::format("({:.2f}, {:.2f}, {:.2f})", v.x(), v.y(), v.z()); }

// Refuses what the motion leaves open, and says which direction.
Expected<void> check_certainty(const HandEyeCalibration& result, const HandEyeSettings& settings) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> rotation(result.covariance.topLeftCorner<3, 3>());
  const Eigen::SelfAdjointEigenSolver<Matrix3d> translation(result.covariance.block<3, 3>(3, 3));
  const double worst_deg = std::sqrt(rotation.eigenvalues()[2]) / kDegree;
  const double worst_mm = std::sqrt(translation.eigenvalues()[2]);
  if (!(worst_mm <= settings.largest_translation_deviation_mm)) {
    return fail(
        fmt::format("the camera's place in the sensor stays open by {:.1f} mm (standard deviation) along {} of the "
                    "camera: turn the "
                    "scope further, about axes across that direction, or record longer",
                    worst_mm, direction_of(translation.eigenvectors().col(2))));
  }
  if (!(worst_deg <= settings.largest_rotation_deviation_deg)) {
    return fail(
        fmt::format("the camera's orientation in the sensor stays open by {:.2f} degrees (standard deviation) about {} "
                    "of the camera: "
                    "turn the scope about other axes too, or record longer",
                    worst_deg, direction_of(rotation.eigenvectors().col(2))));
  }
  return {};
}

Expected<void> check_spread(HandEyeCalibration& result) {
  if (result.pairs.size() < kFewestPairs) {
    return fail(fmt::format(
        "too few poses: at {} times of the camera ({} more fall where the tracker has no pose) both are known, and at "
        "least {} are needed; record longer, with board and sensor in sight",
        result.pairs.size(), result.without_tracker_pose, kFewestPairs));
  }
  std::vector<Matrix3d> rotations;
  for (const PosePair& pair : result.pairs) rotations.push_back(pair.X_WS.R);
  const RotationSpread spread = rotation_spread(rotations);
  result.spread_deg = spread.deviation_rad / kDegree;
  if (result.spread_deg[0] < kFewestSpread_deg) {
    return fail(
        fmt::format("the scope was hardly turned ({:.1f} degrees of standard deviation): turn it about two axes "
                    "and more, by 20 degrees and more, and record again",
                    result.spread_deg[0]));
  }
  if (result.spread_deg[1] < kFewestSpread_deg) {
    return fail(fmt::format(
        "the scope was turned about one axis only, {} of the sensor ({:.1f} degrees of standard deviation; {:.1f} "
        "about "
        "the next): the camera's place along it stays open; turn it about another axis too, and record again",
        direction_of(spread.axes.col(0)), result.spread_deg[0], result.spread_deg[1]));
  }
  return {};
}

}  // namespace

double HandEyeCalibration::target_deviation_mm() const {
  Eigen::Matrix<double, 3, 6> J;
  J << -cross_matrix({0.0, 0.0, kTargetAhead_mm}), Matrix3d::Identity();
  Matrix6d alone = covariance.topLeftCorner<6, 6>();
  if (covariance_by_lens) alone -= covariance_by_lens->topLeftCorner<6, 6>();
  return std::hypot(std::sqrt((J * alone * J.transpose()).trace()), target_deviation_by_lens_mm);
}

Expected<HandEyeCalibration> calibrate_hand_eye(std::vector<TimedPose> camera, std::vector<TimedPose> tracker,
                                                const HandEyeSettings& settings) {
  const std::vector<PosePair> in_rows = pair_rows(camera, tracker);
  camera = in_order(std::move(camera));
  tracker = in_order(std::move(tracker));
  if (in_rows.size() < kFewestPairs && (camera.size() < kFewestPairs || tracker.size() < kFewestPairs)) {
    return fail(fmt::format("too few poses: {} of the camera and {} of the tracker, and at least {} of each are needed",
                            camera.size(), tracker.size(), kFewestPairs));
  }
  HandEyeCalibration result;
  result.covariance.setZero();
  result.error_covariance.setIdentity();
  result.offset_measured = is_sequence(camera) && is_sequence(tracker);
  if (result.offset_measured) {
    const auto found = correlate_motion(camera, tracker, settings.largest_offset_s);
    if (!found) return tl::unexpected(found.error());
    result.offset_s = found->offset_s;
    result.speed_correlation = found->correlation;
    result.speed_offset_s = found->offset_s;
  }
  result.pairs = pair_up(camera, tracker, result.offset_s, !result.offset_measured);
  if (!result.offset_measured && 2 * result.pairs.size() < in_rows.size()) {
    result.pairs = in_rows;
    result.paired_by_rows = true;
  }
  result.without_tracker_pose = result.paired_by_rows ? 0 : camera.size() - result.pairs.size();
  if (result.pairs.empty()) {
    return fail(
        fmt::format("camera and tracker have no times in common (camera {}, tracker {}): give poses of the same "
                    "moments, on one clock",
                    seconds_of(camera), seconds_of(tracker)));
  }
  if (const auto enough = check_spread(result); !enough) return tl::unexpected(enough.error());
  const auto start = hand_eye_closed_form(result.pairs);
  if (!start) return fail("the scope was hardly turned: turn it about two axes and more, and record again");
  result.X_SC = *start;
  result.X_WB = board_in_world(result.pairs, result.X_SC);
  if (const auto adjusted = adjust(result, camera, tracker); !adjusted) return tl::unexpected(adjusted.error());
  if (result.offset_measured) {
    if (const auto refined = refine_offset(result, camera, tracker); !refined) return tl::unexpected(refined.error());
    result.brisk_rad_per_s = brisk_speed(result.pairs, result.X_SC.R);
  }
  if (const auto sound = check_scale(result, settings); !sound) return tl::unexpected(sound.error());
  if (const auto certain = check_certainty(result, settings); !certain) return tl::unexpected(certain.error());
  judge_held_aside(result);
  judge_motions(result, median_interval_s(camera));
  return result;
}

}  // namespace perimap
