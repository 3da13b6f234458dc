#include "daemon/evaluation/surface/surface_watch.hpp"

#include <Eigen/Cholesky>
#include <chrono>
#include <cmath>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/phase_basis.hpp"
#include "core/pipeline/phase_spread.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/surface/six_elements.hpp"
#include "daemon/evaluation/surface/surface_baselines.hpp"

namespace perimap {
namespace {

constexpr Duration kScoredEvery = std::chrono::seconds(1);

Vector3d mean_of(const SurfaceEvidence& evidence, int n) { return {evidence.x(0), evidence.x(n), evidence.x(2 * n)}; }

}  // namespace

struct SurfaceWatch::Scene {
  std::vector<Vector2d> places;  // of the seen points, in the chart
  PredictedPlaces predicted;
  std::vector<Vector2d> features;  // in the chart
  Eigen::VectorXd depths;
  Eigen::MatrixXd barycentric;  // N x V
  Eigen::MatrixXd thin_plate;

  // Of place v at a basis, from the features' motions at it (3 x N), mm, W.
  [[nodiscard]] Vector3d interpolated(const SurfaceChart& chart, const Eigen::MatrixXd& W, Eigen::Index v,
                                      const Eigen::Matrix3Xd& motions) const {
    const auto weights = W.col(v);
    return chart.point_at(places[static_cast<std::size_t>(v)], depths.dot(weights)) + motions * weights;
  }
};

SurfaceWatch::SurfaceWatch(Pipeline& pipeline, const RecordedTruth& truth)
    : pipeline_(pipeline),
      truth_(truth.truth),
      seen_(truth.truth, truth.camera),
      first_frame_(truth.captures.begin()->second) {}

const PeriodicSurface* SurfaceWatch::surface() const noexcept {
  return made_ && made_->surface ? &*made_->surface : nullptr;
}

void SurfaceWatch::after_frame() {
  const auto capture = from_ns(static_cast<std::int64_t>(pipeline_.counters().last_frame_ns.get()));
  if (last_scored_ && capture - *last_scored_ < kScoredEvery) return;
  last_scored_ = capture;
  seen_.look(capture);
  made_ = pipeline_.surface_maker().newest();
  if (made_ == nullptr) {
    refusal_ = "none has been made";
  } else if (!made_->surface) {
    refusal_ = made_->refusal.message;
  }
  score(capture);
}

void SurfaceWatch::score(Instant capture) {
  tally_.begin_instant(to_seconds(capture - first_frame_));
  Scene scene;
  if (surface() != nullptr) {
    const SurfaceChart& chart = surface()->chart();
    for (const std::size_t point : seen_.seen()) scene.places.push_back(chart.place_of(seen_.mean_place(point)).s);
    scene.predicted = surface()->predict(scene.places);
    const std::vector<bool> front = seen_.in_front_of(chart.X_WA.t);
    for (std::size_t i = 0; i < front.size(); ++i) {
      if (!front[i]) scene.predicted.support[i] = Support::kOutsideChart;
    }
    const int n = surface()->layout().size();
    scene.depths.resize(static_cast<Eigen::Index>(surface()->evidence().size()));
    for (std::size_t i = 0; i < surface()->evidence().size(); ++i) {
      const SurfaceChart::Place place = chart.place_of(mean_of(surface()->evidence()[i], n));
      scene.features.push_back(place.s);
      scene.depths(static_cast<Eigen::Index>(i)) = place.depth_mm;
    }
    scene.barycentric = barycentric_weights(scene.features, scene.places);
    scene.thin_plate = thin_plate_weights(scene.features, scene.places);
    for (std::size_t h = 0; h < kSurfaceHorizons_ms.size(); ++h) {
      const PipelineSettings& settings = pipeline_.settings();
      score_instant(scene, h,
                    capture + settings.latency + settings.lead + std::chrono::milliseconds(kSurfaceHorizons_ms[h]));
    }
  }
  for (std::size_t i = 0; i < seen_.seen().size(); ++i) {
    tally_.add_seen(surface() != nullptr && scene.predicted.support[i] == Support::kSupported,
                    seen_.seen_well(seen_.seen()[i]));
  }
  tally_.end_instant();
}

void SurfaceWatch::score_instant(const Scene& scene, std::size_t horizon, Instant valid) {
  // As a surface that is released then has it.
  const PipelineSettings& settings = pipeline_.settings();
  const Instant now = valid - settings.lead - std::chrono::milliseconds(kSurfaceHorizons_ms[horizon]);
  const PhaseEstimate phase = pipeline_.status_clock(now).at(valid);
  if (!usable(phase.state)) return;
  const RespiratoryPhase respiration = pipeline_.status_respiration().at(valid);
  const BasisLayout& layout = surface()->layout();
  const Basis b = basis_at(layout, phase.phase_rad, respiration);
  const BasesAbout about = bases_about(layout, phase, respiration);
  const double breath_mm2 = respiration.deviation_mm * respiration.deviation_mm;

  Basis motion_b = b;
  motion_b(0) = 0.0;
  Eigen::Matrix3Xd motions(3, static_cast<Eigen::Index>(surface()->evidence().size()));
  for (std::size_t i = 0; i < surface()->evidence().size(); ++i) {
    motions.col(static_cast<Eigen::Index>(i)) = position_of(surface()->evidence()[i].x, motion_b);
  }
  std::vector<Vector3d> vertices(truth_.mesh().vertex_count);
  truth_.vertices_at(valid, vertices);
  if (horizon == 0 && tally_.settled() && made_->of_model) {
    model_.add(made_->mesh, b, about, breath_mm2, surface_with(truth_.mesh(), vertices));
  }
  for (std::size_t i = 0; i < scene.places.size(); ++i) {
    if (scene.predicted.support[i] != Support::kSupported) continue;
    const auto v = static_cast<Eigen::Index>(i);
    const std::size_t point = seen_.seen()[i];
    const auto c = scene.predicted.coefficients_W_mm.middleRows<3>(3 * v);
    const Vector3d p = c * b;
    const Vector3d truth = seen_.position(point, vertices);
    Matrix3d covariance = from_six(scene.predicted.covariances_W_mm2.col(v));
    covariance += phase_spread(p, c * about.earlier, c * about.later) + breath_mm2 * Matrix3d::Identity();
    const Vector3d e = p - truth;
    const bool on_rim = seen_.on_rim(point);
    tally_.add(horizon, {point, on_rim, e.norm(), e.dot(covariance.ldlt().solve(e)) / 3.0});
    if (horizon != 0 || on_rim || scene.barycentric.col(v).isZero()) continue;
    const SurfaceChart& chart = surface()->chart();
    tally_.add_compared(e.norm(), (scene.interpolated(chart, scene.barycentric, v, motions) - truth).norm(),
                        (scene.interpolated(chart, scene.thin_plate, v, motions) - truth).norm());
  }
}

SurfaceFigures SurfaceWatch::figures() const {
  SurfaceFigures figures = tally_.figures();
  figures.model = model_.figures();
  figures.refusal = refusal_;
  figures.begun = pipeline_.surface_maker().starts().begun.get();
  figures.contradicting = pipeline_.surface_maker().starts().contradicting.get();
  if (surface() == nullptr) return figures;
  if (made_->of_model) figures.model.motion = motion_figures(*surface());
  figures.agreement_rms_mm = surface()->agreement().rms_mm;
  figures.agreement_nees = surface()->agreement().nees;
  figures.features = surface()->features();
  figures.contradicted = surface()->contradicted().size();
  return figures;
}

}  // namespace perimap
