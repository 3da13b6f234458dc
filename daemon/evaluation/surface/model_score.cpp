#include "daemon/evaluation/surface/model_score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/geometry/nearest_triangle.hpp"
#include "core/surface/six_elements.hpp"
#include "daemon/evaluation/json/json_number.hpp"

namespace perimap {

void ModelScore::add(const SurfaceMesh& mesh, const Basis& b, const BasesAbout& about, double breath_mm2,
                     const TriangleMesh& truth) {
  vertices_ = mesh.support.size();
  ++instants_;
  const NearestTriangle nearest(truth);
  for (std::size_t v = 0; v < mesh.support.size(); ++v) {
    if (mesh.support[v] != Support::kSupported) continue;
    const auto column = static_cast<Eigen::Index>(v);
    const auto c = mesh.coefficients_W_mm.middleRows<3>(3 * column);
    const Vector3d p = c * b;
    const Matrix3d covariance = from_six(mesh.covariances_W_mm2.col(column)) +
                                phase_spread(p, c * about.earlier, c * about.later) + breath_mm2 * Matrix3d::Identity();
    const NearestPlace place = nearest.to(p);
    const double along_mm = place.normal.dot(p - place.point);
    errors_mm_.push_back(static_cast<float>((p - place.point).norm()));
    nees_ += along_mm * along_mm / place.normal.dot(covariance * place.normal);
  }
}

ModelFigures ModelScore::figures() const {
  ModelFigures figures;
  figures.vertices = vertices_;
  if (instants_ > 0) figures.supported = static_cast<double>(errors_mm_.size()) / static_cast<double>(instants_);
  if (errors_mm_.empty()) return figures;
  double squares = 0.0;
  for (const float error : errors_mm_) squares += static_cast<double>(error) * static_cast<double>(error);
  const auto count = static_cast<double>(errors_mm_.size());
  figures.rms_mm = std::sqrt(squares / count);
  figures.nees = nees_ / count;
  std::vector<float> sorted = errors_mm_;
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(0.95 * count)) - 1;
  std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
  figures.p95_mm = sorted[static_cast<std::size_t>(rank)];
  return figures;
}

nlohmann::json to_json(const ModelFigures& figures) {
  if (figures.vertices == 0) return nullptr;
  return {{"vertices", figures.vertices},
          {"supported", json_number(figures.supported)},
          {"rms_mm", json_number(figures.rms_mm)},
          {"p95_mm", json_number(figures.p95_mm)},
          {"nees", json_number(figures.nees)}};
}

std::string to_text(const ModelFigures& figures) {
  if (figures.vertices == 0) return {};
  if (!std::isfinite(figures.rms_mm)) {
    return fmt::format("model: none of its {} vertices is where the surface is seen", figures.vertices);
  }
  return fmt::format(
      "model: {:.0f} of {} vertices supported, {:.3f} mm RMS from the true surface (95 % {:.2f}), "
      "NEES along its normal {:.2f}",
      figures.supported, figures.vertices, figures.rms_mm, figures.p95_mm, figures.nees);
}

}  // namespace perimap
