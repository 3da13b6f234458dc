#include "daemon/setup/setup_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

std::string three(const Vector3d& v, int decimals) {
  return fmt::format("{:.{}f} {:.{}f} {:.{}f}", v.x(), decimals, v.y(), decimals, v.z(), decimals);
}

nlohmann::json list(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
nlohmann::json list(const double (&q)[4]) { return {q[0], q[1], q[2], q[3]}; }

template <class Matrix>
nlohmann::json rows_of(const Matrix& m) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    nlohmann::json row = nlohmann::json::array();
    for (Eigen::Index j = 0; j < m.cols(); ++j) row.push_back(m(i, j));
    rows.push_back(row);
  }
  return rows;
}

std::size_t used_of(const std::vector<char>& used) {
  return static_cast<std::size_t>(std::count(used.begin(), used.end(), 1));
}

double rotation_between_deg(const Matrix3d& a, const Matrix3d& b) {
  return so3_log(a.transpose() * b).norm() / kDegree;
}

}  // namespace

QuaternionFigures quaternion_figures(const Matrix3d& R, const Matrix3d& covariance) {
  QuaternionFigures figures{};
  rotation_to_wxyz(R, figures.wxyz);
  const auto& [w, x, y, z] = figures.wxyz;
  // q exp(e / 2), to first order
  Eigen::Matrix<double, 4, 3> J;
  J << -x, -y, -z, w, -z, y, z, w, -x, -y, x, w;
  J *= 0.5;
  const Eigen::Matrix4d C = J * covariance * J.transpose();
  for (int i = 0; i < 4; ++i) figures.deviation[i] = std::sqrt(std::max(0.0, C(i, i)));
  return figures;
}

std::string offset_text_of(const HandEyeCalibration& result) {
  std::string text =
      fmt::format("  time offset    {:.2f} ms, deviation {:.2f}: added to the tracker's times to get the camera's\n",
                  1e3 * result.offset_s, 1e3 * std::sqrt(result.covariance(6, 6)));
  text += fmt::format("                 {:.2f} ms by the angular speeds alone, which correlate by {:.3f}\n",
                      1e3 * result.speed_offset_s, result.speed_correlation);
  text +=
      fmt::format("                 {:.2f} ms if no error lasted longer than a pose\n", 1e3 * result.joint_offset_s);
  if (!result.is_brisk()) {
    text += fmt::format(
        "                 may be wrong by more than it says, and is set in no configuration: nothing moved briskly "
        "({:.2f} rad/s within half a second, "
        "{:g} and more are needed), and what is wrong with the lens then passes for time; swing the scope briskly now "
        "and then, and record again\n",
        result.brisk_rad_per_s, HandEyeCalibration::kLeastBrisk_rad_per_s);
  }
  return text;
}

nlohmann::json offset_json_of(const HandEyeCalibration& result) {
  return {{"time_offset_ms", 1e3 * result.offset_s},
          {"time_offset_ms_deviation", 1e3 * std::sqrt(result.covariance(6, 6))},
          {"joint_time_offset_ms", 1e3 * result.joint_offset_s},
          {"speed_time_offset_ms", 1e3 * result.speed_offset_s},
          {"speed_correlation", result.speed_correlation},
          {"brisk_rad_per_s", result.brisk_rad_per_s},
          {"brisk", result.is_brisk()}};
}

std::string scale_text_of(const BoardScale& scale) {
  if (!std::isfinite(scale.deviation))
    return "  scale          of the board beside the tracker: not told by this motion\n";
  return fmt::format(
      "  scale          the board is {:.4f} times as large by the tracker as was said, deviation {:.4f}\n", scale.ratio,
      scale.deviation);
}

std::string text_of(const HandEyeCalibration& result) {
  const QuaternionFigures q = quaternion_figures(result.X_SC.R, result.covariance.topLeftCorner<3, 3>());
  const Eigen::Matrix<double, 7, 1> deviation = result.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  std::string text = fmt::format("Hand-eye X_SC, the camera in the sensor, by {} poses of both over {:.1f} s\n",
                                 used_of(result.used), result.pairs.back().t_s - result.pairs.front().t_s);
  text += fmt::format("  translation    {} mm, deviations {} along the camera's axes\n", three(result.X_SC.t, 2),
                      three(deviation.segment<3>(3), 2));
  text += fmt::format("  rotation       {:.6f} (w x y z), deviations {} degrees about the camera's axes\n",
                      fmt::join(q.wxyz, " "), three(deviation.head<3>() / kDegree, 3));
  text += fmt::format("  a target       {:.0f} mm ahead is known within {:.2f} mm by that (standard deviation)\n",
                      HandEyeCalibration::kTargetAhead_mm, result.target_deviation_mm());
  if (const auto& by_lens = result.covariance_by_lens) {
    const Eigen::Matrix<double, 7, 1> of_lens = by_lens->diagonal().cwiseMax(0.0).cwiseSqrt();
    text += fmt::format("  the lens       makes {} mm and {} degrees of these deviations, {:.2f} mm of the target's\n",
                        three(of_lens.segment<3>(3), 2), three(of_lens.head<3>() / kDegree, 3),
                        result.target_deviation_by_lens_mm);
  } else {
    text += fmt::format("  the lens       is taken for exact, so that these deviations are too small: {}\n",
                        result.lens_untold);
  }
  if (result.offset_measured) {
    text += offset_text_of(result);
  } else if (result.paired_by_rows) {
    text += "  time offset    not measured: the times of the two files say nothing, and poses were paired row by row\n";
  } else {
    text += "  time offset    not measured: the poses are apart, each taken at rest\n";
  }
  text += fmt::format("  AX - XB        {:.2f} mm, the median of all {} pairs of poses {:.3g} s apart\n",
                      result.residual_median_mm, result.disagreements_mm.size(), result.disagreement_interval_s);
  for (const OtherHandEye& other : result.others) {
    text += fmt::format("    OpenCV {:<12} {:.2f} mm; its place is {:.2f} mm and {:.2f} degrees from this one\n",
                        other.method, other.residual_median_mm, (other.X_SC.t - result.X_SC.t).norm(),
                        rotation_between_deg(other.X_SC.R, result.X_SC.R));
  }
  text +=
      fmt::format("  held aside     each fifth by the others: {:.2f} mm and {:.2f} degrees RMS ({:.2f} mm fitted)\n",
                  result.held_aside_rms_mm, result.held_aside_rms_deg, result.fitted_rms_mm);
  text += scale_text_of(result.scale);
  text +=
      fmt::format("  turned         {} degrees (standard deviation about three axes)\n", three(result.spread_deg, 1));
  text += fmt::format("  left out       {} of {} poses off; {} where the tracker has none\n",
                      result.used.size() - used_of(result.used), result.used.size(), result.without_tracker_pose);
  return text;
}

nlohmann::json json_of(const HandEyeCalibration& result) {
  const QuaternionFigures q = quaternion_figures(result.X_SC.R, result.covariance.topLeftCorner<3, 3>());
  const Eigen::Matrix<double, 7, 1> deviation = result.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  // The translation's covariance is along C's axes; the configuration has it along S's.
  const Matrix3d translation_S = result.X_SC.R * result.covariance.block<3, 3>(3, 3) * result.X_SC.R.transpose();
  nlohmann::json json = {
      {"translation_mm", list(result.X_SC.t)},
      {"translation_mm_deviation", list(Vector3d(translation_S.diagonal().cwiseSqrt()))},
      {"rotation_wxyz", list(q.wxyz)},
      {"rotation_wxyz_deviation", list(q.deviation)},
      {"rotation_deg_deviation", list(Vector3d(deviation.head<3>() / kDegree))},
      {"target_mm_deviation", result.target_deviation_mm()},
      {"target_mm_deviation_by_lens", result.target_deviation_by_lens_mm},
      {"lens_is_taken_for_exact", !result.covariance_by_lens.has_value()},
      {"lens_is_taken_for_exact_because",
       result.covariance_by_lens ? nlohmann::json() : nlohmann::json(result.lens_untold)},
      {"time_offset_ms", nullptr},
      {"time_offset_ms_deviation", nullptr},
      {"residual_median_mm", result.residual_median_mm},
      {"residual_median_mm_deviation", result.residual_median_mm_deviation},
      {"residual_pairs", result.disagreements_mm.size()},
      {"residual_interval_s", result.disagreement_interval_s},
      {"covariance", rows_of(result.covariance)},
      {"covariance_order", "rotation about C's axes (rad), translation along C's axes (mm), time offset (s)"},
      {"covariance_with_principal_point", rows_of(result.covariance_with_principal)},
      {"fitted_rms_mm", result.fitted_rms_mm},
      {"held_aside_rms_mm", result.held_aside_rms_mm},
      {"held_aside_rms_deg", result.held_aside_rms_deg},
      {"rotation_spread_deg", list(result.spread_deg)},
      {"poses", used_of(result.used)},
      {"poses_left_out", result.used.size() - used_of(result.used)},
      {"poses_without_tracker", result.without_tracker_pose},
      {"paired_by_rows", result.paired_by_rows},
      {"correlation_length", result.correlation_length}};
  if (std::isfinite(result.scale.deviation)) {
    json["board_scale"] = result.scale.ratio;
    json["board_scale_deviation"] = result.scale.deviation;
  }
  if (result.offset_measured) {
    json.update(offset_json_of(result));
  }
  const QuaternionFigures board = quaternion_figures(result.X_WB.R, Matrix3d::Zero());
  json["board_translation_WB_mm"] = list(result.X_WB.t);
  json["board_rotation_WB_wxyz"] = list(board.wxyz);
  for (const OtherHandEye& other : result.others) {
    const QuaternionFigures o = quaternion_figures(other.X_SC.R, Matrix3d::Zero());
    json["opencv"][other.method] = {{"translation_mm", list(other.X_SC.t)},
                                    {"rotation_wxyz", list(o.wxyz)},
                                    {"residual_median_mm", other.residual_median_mm}};
  }
  return json;
}

std::string text_of(const SignalOffset& result) {
  std::string text = fmt::format(
      "Time offset {:.2f} ms, deviation {:.2f}: added to the second signal's times to get the first one's\n",
      1e3 * result.offset_s, 1e3 * result.deviation_s);
  text += fmt::format("  correlation    {:.4f} over {:.1f} s; the next best offset, {:.0f} ms, has {:.4f}\n",
                      result.correlation, result.overlap_s, 1e3 * result.rival_offset_s, result.rival);
  text += fmt::format("  held aside     by each half alone: {:.2f} and {:.2f} ms\n", 1e3 * result.first_half_s,
                      1e3 * result.second_half_s);
  text += fmt::format("  residual       {:.4g} RMS in the first signal's unit; {} samples, {} left out\n",
                      result.residual_rms, result.used, result.discarded);
  return text;
}

nlohmann::json json_of(const SignalOffset& result) {
  return {{"time_offset_ms", 1e3 * result.offset_s},
          {"time_offset_ms_deviation", 1e3 * result.deviation_s},
          {"correlation", result.correlation},
          {"rival_correlation", result.rival},
          {"rival_offset_ms", 1e3 * result.rival_offset_s},
          {"overlap_s", result.overlap_s},
          {"gain", result.gain},
          {"residual_rms", result.residual_rms},
          {"halves_ms", {1e3 * result.first_half_s, 1e3 * result.second_half_s}},
          {"samples", result.used},
          {"samples_left_out", result.discarded}};
}

std::string text_of(const PivotCalibration& result) {
  const Vector3d deviation = result.covariance_T.diagonal().cwiseSqrt();
  std::string text = fmt::format("Tool tip, in the tool's frame, by {} poses\n", used_of(result.used));
  text += fmt::format("  tip            {} mm, deviations {}\n", three(result.tip_T, 2), three(deviation, 2));
  text += fmt::format("  residual       {:.2f} mm RMS, {:.2f} at worst; {:.2f} mm RMS of all {} poses fitted alike\n",
                      result.rms_mm, result.worst_mm, result.rms_all_mm, result.used.size());
  text += fmt::format("  held aside     each fifth by the others: {:.2f} mm RMS\n", result.held_aside_mm);
  text +=
      fmt::format("  turned         {} degrees (standard deviation about three axes)\n", three(result.spread_deg, 1));
  text +=
      fmt::format("  left out       {} of {} poses\n", result.used.size() - used_of(result.used), result.used.size());
  return text;
}

nlohmann::json json_of(const PivotCalibration& result) {
  return {{"tip_mm", list(result.tip_T)},
          {"tip_mm_deviation", list(Vector3d(result.covariance_T.diagonal().cwiseSqrt()))},
          {"translation_mm", list(result.tip_T)},
          {"translation_mm_deviation", list(Vector3d(result.covariance_T.diagonal().cwiseSqrt()))},
          {"pivot_mm", list(result.pivot_W)},
          {"covariance", rows_of(result.covariance_T)},
          {"rms_mm", result.rms_mm},
          {"rms_all_mm", result.rms_all_mm},
          {"worst_mm", result.worst_mm},
          {"held_aside_rms_mm", result.held_aside_mm},
          {"rotation_spread_deg", list(result.spread_deg)},
          {"poses", used_of(result.used)},
          {"poses_left_out", result.used.size() - used_of(result.used)}};
}

std::string text_of(const MeasuredNoise& result) {
  std::string text = fmt::format("Tracker's noise, by {} poses of a sensor that was still for {:.1f} s\n", result.poses,
                                 result.still_s);
  text += fmt::format("  position_deviation_mm   {:.3f}, deviation {:.3f} (RMS of the 3-D norm)\n",
                      result.position_deviation_mm, result.position_deviation_mm_deviation);
  text += fmt::format("  rotation_deviation_deg  {:.3f}, deviation {:.3f}\n", result.rotation_deviation_deg,
                      result.rotation_deviation_deg_deviation);
  if (result.correlation_s > 0.0) {
    text += fmt::format(
        "  error_correlation_s     {:.3f}, within a factor of {:.2f}; {:.0f} % of the variance lasts so long\n",
        result.correlation_s, result.correlation_s_factor, 100.0 * result.lasting_share);
  } else {
    text += "  error_correlation_s     0: each pose's error is new\n";
  }
  if (result.drifts) {
    text += "  the error lasts longer than a tenth of that time: hold the sensor still for longer to know it\n";
  }
  text += "  averaged over s, Allan deviation mm, deg\n";
  for (const AllanPoint& point : result.allan) {
    text += fmt::format("    {:>8.3f} {:>8.4f} {:>8.4f}\n", point.averaged_s, point.position_mm, point.rotation_deg);
  }
  return text;
}

nlohmann::json json_of(const MeasuredNoise& result) {
  nlohmann::json allan = nlohmann::json::array();
  for (const AllanPoint& point : result.allan) {
    allan.push_back(
        {{"averaged_s", point.averaged_s}, {"position_mm", point.position_mm}, {"rotation_deg", point.rotation_deg}});
  }
  return {{"position_deviation_mm", result.position_deviation_mm},
          {"position_deviation_mm_deviation", result.position_deviation_mm_deviation},
          {"rotation_deviation_deg", result.rotation_deviation_deg},
          {"rotation_deviation_deg_deviation", result.rotation_deviation_deg_deviation},
          {"error_correlation_s", result.correlation_s},
          {"error_correlation_s_deviation", result.correlation_s * (result.correlation_s_factor - 1.0)},
          {"lasting_share", result.lasting_share},
          {"drifts", result.drifts},
          {"still_s", result.still_s},
          {"poses", result.poses},
          {"allan", allan}};
}

std::string text_of(const LandmarkRegistration& result, const std::vector<Landmark>& landmarks,
                    const std::vector<TargetError>& targets) {
  const Eigen::Matrix<double, 6, 1> deviation = result.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const QuaternionFigures q = quaternion_figures(result.X_IW.R, Matrix3d::Zero());
  std::string text = fmt::format("Registration X_IW by {} landmarks\n", landmarks.size());
  text += fmt::format("  translation    {} mm\n  rotation       {:.6f} (w x y z)\n", three(result.X_IW.t, 2),
                      fmt::join(q.wxyz, " "));
  if (result.fle_mm > 0.0) {
    text += fmt::format("  deviations     {} mm at the landmarks' middle, {} degrees\n", three(deviation.tail<3>(), 2),
                        three(deviation.head<3>() / kDegree, 2));
    text += fmt::format("  FRE            {:.2f} mm; one landmark's error by it (FLE) {:.2f} mm\n", result.fre_mm,
                        result.fle_mm);
  } else {
    text += fmt::format("  deviations     not known\n  FRE            {:.2f} mm\n", result.fre_mm);
  }
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    text += fmt::format("    {:<14} {:.2f} mm", landmarks[i].name, result.residuals_mm[i]);
    if (!result.held_aside_mm.empty()) text += fmt::format("; by the others {:.2f} mm", result.held_aside_mm[i]);
    text += "\n";
  }
  for (const TargetError& target : targets) {
    text += fmt::format("  TRE expected   {:.2f} mm RMS at {}\n", target.error_mm, three(target.target_I, 1));
  }
  if (result.fle_mm == 0.0) {
    text += "  three landmarks fit almost anyhow: with four and more the error is known\n";
  }
  return text;
}

nlohmann::json json_of(const LandmarkRegistration& result, const std::vector<Landmark>& landmarks,
                       const std::vector<TargetError>& targets) {
  // About the landmarks' middle; at the origin of I the rotation moves it too.
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Identity();
  J.bottomLeftCorner<3, 3>() = cross_matrix(result.X_IW.t - result.middle_I) * -1.0;
  const Eigen::Matrix<double, 6, 6> at_translation = J * result.covariance * J.transpose();
  const Matrix3d rotation_W = result.X_IW.R.transpose() * result.covariance.topLeftCorner<3, 3>() * result.X_IW.R;
  const QuaternionFigures q = quaternion_figures(result.X_IW.R, rotation_W);
  nlohmann::json json = {{"translation_mm", list(result.X_IW.t)},
                         {"rotation_wxyz", list(q.wxyz)},
                         {"rotation_wxyz_deviation", list(q.deviation)},
                         {"fre_mm", result.fre_mm},
                         {"fle_mm", result.fle_mm},
                         {"covariance", rows_of(result.covariance)},
                         {"covariance_about_mm", list(result.middle_I)}};
  json["translation_mm_deviation"] = list(Vector3d(at_translation.diagonal().tail<3>().cwiseMax(0.0).cwiseSqrt()));
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    nlohmann::json one = {{"name", landmarks[i].name}, {"residual_mm", result.residuals_mm[i]}};
    if (!result.held_aside_mm.empty()) one["held_aside_mm"] = result.held_aside_mm[i];
    json["landmarks"].push_back(one);
  }
  if (!(result.fle_mm > 0.0)) {
    for (const char* key : {"rotation_wxyz_deviation", "translation_mm_deviation", "fle_mm", "covariance"}) {
      json[key] = nullptr;  // three landmarks tell no error
    }
  }
  json["targets"] = nlohmann::json::array();
  for (const TargetError& target : targets) {
    json["targets"].push_back({{"target_mm", list(target.target_I)}, {"tre_mm", target.error_mm}});
  }
  return json;
}

}  // namespace perimap
