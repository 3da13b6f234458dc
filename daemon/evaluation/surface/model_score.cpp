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
    const auto column = static_cast<Eigen::Index>(v);
    const auto c = mesh.coefficients_W_mm.middleRows<3>(3 * column);
    const Vector3d p = c * b;
    const Matrix3d covariance = from_six(mesh.covariances_W_mm2.col(column)) +
                                phase_spread(p, c * about.earlier, c * about.later) + breath_mm2 * Matrix3d::Identity();
    const NearestPlace place = nearest.to(p);
    const double along_mm = place.normal.dot(p - place.point);
    const double nees = along_mm * along_mm / place.normal.dot(covariance * place.normal);
    if (mesh.support[v] != Support::kSupported) {
      unseen_mm2_ += (p - place.point).squaredNorm();
      unseen_nees_ += nees;
      ++unseen_;
      continue;
    }
    errors_mm_.push_back(static_cast<float>((p - place.point).norm()));
    nees_ += nees;
  }
}

ModelFigures ModelScore::figures() const {
  ModelFigures figures;
  figures.vertices = vertices_;
  if (instants_ > 0) figures.supported = static_cast<double>(errors_mm_.size()) / static_cast<double>(instants_);
  if (unseen_ > 0) {
    figures.unseen_rms_mm = std::sqrt(unseen_mm2_ / static_cast<double>(unseen_));
    figures.unseen_nees = unseen_nees_ / static_cast<double>(unseen_);
  }
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

std::optional<ModelMotionFigures> motion_figures(const PeriodicSurface& surface) {
  if (surface.model() == nullptr) return std::nullopt;
  ModelMotionFigures figures{surface.model()->harmonics(), surface.model()->residual_mm(), {}};
  for (const HarmonicGroup group : {HarmonicGroup::kLow, HarmonicGroup::kHigh}) {
    const auto& field = surface.motion()[static_cast<std::size_t>(group)];
    if (!field) continue;
    const int first = bands_of(surface.layout(), group).first;
    for (std::size_t band = 0; band < field->gains().size(); ++band) {
      const int harmonic = first + static_cast<int>(band) + 1;
      if (harmonic > figures.harmonics) break;
      const HarmonicGain& gain = field->gains()[band];
      figures.gains.push_back({harmonic, gain.in_step, gain.out_of_step, std::sqrt(gain.variance)});
    }
  }
  return figures;
}

namespace {

nlohmann::json to_json(const ModelMotionFigures& motion) {
  nlohmann::json gains = nlohmann::json::array();
  for (const ModelMotionFigures::Gain& gain : motion.gains) {
    gains.push_back({{"harmonic", gain.harmonic},
                     {"in_step", json_number(gain.in_step)},
                     {"out_of_step", json_number(gain.out_of_step)},
                     {"deviation", json_number(gain.deviation)}});
  }
  return {{"harmonics", motion.harmonics}, {"residual_mm", json_number(motion.residual_mm)}, {"gains", gains}};
}

}  // namespace

nlohmann::json to_json(const ModelFigures& figures) {
  if (figures.vertices == 0) return nullptr;
  return {{"vertices", figures.vertices},
          {"supported", json_number(figures.supported)},
          {"rms_mm", json_number(figures.rms_mm)},
          {"p95_mm", json_number(figures.p95_mm)},
          {"nees", json_number(figures.nees)},
          {"unseen_rms_mm", json_number(figures.unseen_rms_mm)},
          {"unseen_nees", json_number(figures.unseen_nees)},
          {"motion", figures.motion ? to_json(*figures.motion) : nlohmann::json(nullptr)}};
}

std::string to_text(const ModelFigures& figures) {
  if (figures.vertices == 0) return {};
  if (!std::isfinite(figures.rms_mm)) {
    return fmt::format("model: none of its {} vertices is where the surface is seen", figures.vertices);
  }
  std::string text = fmt::format(
      "model: {:.0f} of {} vertices supported, {:.3f} mm RMS from the true surface (95 % {:.2f}), "
      "NEES along its normal {:.2f}",
      figures.supported, figures.vertices, figures.rms_mm, figures.p95_mm, figures.nees);
  if (!figures.motion) return text;
  text += fmt::format("; its own motion has {} harmonics", figures.motion->harmonics);
  if (figures.motion->gains.empty()) return text + ", and features do not move so";
  const ModelMotionFigures::Gain& first = figures.motion->gains.front();
  return text + fmt::format(", of harmonic {} features have {:.2f} +- {:.2f}", first.harmonic,
                            std::hypot(first.in_step, first.out_of_step), first.deviation);
}

}  // namespace perimap
