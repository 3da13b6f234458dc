#include "daemon/setup/refinement_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>

#include "core/angle/angle.hpp"
#include "daemon/setup/setup_report.hpp"

namespace perimap {
namespace {

std::string triple(const Vector3d& v, int decimals) {
  return fmt::format("{:.{}f} {:.{}f} {:.{}f}", v.x(), decimals, v.y(), decimals, v.z(), decimals);
}

nlohmann::json json_list(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::string text_of(const Refinement& refinement, const RefinementSource& source) {
  const ModelFit& fit = refinement.fit;
  const Vector6d deviation = fit.estimate.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const QuaternionFigures q = quaternion_figures(fit.estimate.X_IW.R, Matrix3d::Zero());
  std::string text = fmt::format("Registration X_IW by {} against the surface at {:.1f} s, at {:.0f} % of the cycle\n",
                                 source.model, refinement.surface.since_begin_s, 100.0 * source.cycle_share);
  text += fmt::format("  translation    {} mm\n  rotation       {:.6f} (w x y z)\n", triple(fit.estimate.X_IW.t, 2),
                      fmt::join(q.wxyz, " "));
  text += fmt::format("  deviations     {} mm at the surface's middle, {} degrees\n", triple(deviation.tail<3>(), 2),
                      triple(deviation.head<3>() / kDegree, 2));
  text += fmt::format("  at the organ   {:.2f} mm RMS, what the registration may be off by\n", fit.organ_deviation_mm);
  text += fmt::format("  residual       {:.2f} mm RMS, before {:.2f}; {:.2f} explained by the errors declared\n",
                      fit.residual_mm, fit.start_residual_mm, fit.expected_residual_mm);
  text += fmt::format("  moved          {:.2f} mm RMS at the organ and {:.2f} degrees from the start\n", fit.moved_mm,
                      fit.moved_rad / kDegree);
  text += fmt::format("  surface        {} points of {} features met the model; {} beyond its edges, {} facing away\n",
                      fit.points, refinement.surface.features, fit.beyond_edge, fit.turned_away);
  if (refinement.surface.breath_known) {
    text += "  breathing      taken in its middle: the registration is that of a breath half drawn\n";
  }
  if (fit.told_by_start > 0) {
    text += fmt::format("  of 6 directions (turns and shifts) {} are told by the start rather than by the surface\n",
                        fit.told_by_start);
  }
  if (refinement.difference) {
    text += fmt::format("  beside {}: {:.2f} mm RMS at the organ, {:.2f} at most; NEES {:.2f}\n", source.compare,
                        refinement.difference->rms_mm, refinement.difference->largest_mm, refinement.difference->nees);
  }
  for (const std::string& doubt : refinement.mesh_doubts) text += fmt::format("  the model      {}\n", doubt);
  for (const std::string& doubt : fit.doubts) text += fmt::format("  DOUBTED        {}\n", doubt);
  return text;
}

nlohmann::json json_of(const Refinement& refinement) {
  const ModelFit& fit = refinement.fit;
  const RigidEstimate& estimate = fit.estimate;
  // At the origin of I the rotation moves the translation too.
  Matrix6d J = Matrix6d::Identity();
  J.bottomLeftCorner<3, 3>() = cross_matrix(estimate.X_IW.t - estimate.middle_I) * -1.0;
  const Matrix6d at_translation = J * estimate.covariance * J.transpose();
  const Matrix3d& R = estimate.X_IW.R;
  const QuaternionFigures q = quaternion_figures(R, R.transpose() * estimate.covariance.topLeftCorner<3, 3>() * R);
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index i = 0; i < 6; ++i) {
    nlohmann::json row = nlohmann::json::array();
    for (Eigen::Index j = 0; j < 6; ++j) row.push_back(estimate.covariance(i, j));
    rows.push_back(row);
  }
  nlohmann::json json = {
      {"translation_mm", json_list(estimate.X_IW.t)},
      {"translation_mm_deviation", json_list(Vector3d(at_translation.diagonal().tail<3>().cwiseMax(0.0).cwiseSqrt()))},
      {"rotation_wxyz", {q.wxyz[0], q.wxyz[1], q.wxyz[2], q.wxyz[3]}},
      {"rotation_wxyz_deviation", {q.deviation[0], q.deviation[1], q.deviation[2], q.deviation[3]}},
      {"covariance", rows},
      {"covariance_about_mm", json_list(estimate.middle_I)},
      {"organ_deviation_mm", fit.organ_deviation_mm},
      {"start_residual_mm", fit.start_residual_mm},
      {"residual_mm", fit.residual_mm},
      {"expected_residual_mm", fit.expected_residual_mm},
      {"moved_mm", fit.moved_mm},
      {"moved_deg", fit.moved_rad / kDegree},
      {"points", fit.points},
      {"points_beyond_edge", fit.beyond_edge},
      {"points_facing_away", fit.turned_away},
      {"features", refinement.surface.features},
      {"directions_told_by_start", fit.told_by_start},
      {"model_border_edges", refinement.border_edges},
      {"model_doubts", refinement.mesh_doubts},
      {"doubts", fit.doubts}};
  if (refinement.difference) {
    json["compared"] = {{"rms_mm", refinement.difference->rms_mm},
                        {"largest_mm", refinement.difference->largest_mm},
                        {"nees", refinement.difference->nees}};
  }
  return json;
}

}  // namespace perimap
