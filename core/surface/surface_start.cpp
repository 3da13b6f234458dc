#include "core/surface/surface_start.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/estimation/prior_start.hpp"
#include "core/surface/surface_prior.hpp"

namespace perimap {
namespace {

// Of PriorStart::prior_misfit, above which it is not the surface that was seen.
constexpr double kContradictedPrior = 4.0;

// Where the surface's mean place lies that an observation shows. Nothing when the search does not end.
template <class Model>
std::optional<Vector2d> place_of(const PeriodicSurface& surface, const Observation& observation, const Model& model) {
  const SurfaceChart& chart = surface.chart();
  Vector3d ray_C;
  if (!model.ray(observation.z, ray_C)) return std::nullopt;
  const Pose X_WC = observation.X_CW.inverse();
  const Vector3d ray_W = X_WC.R * ray_C;
  const double rise = chart.X_WA.R.col(2).dot(ray_W);
  if (!(rise > 0.1)) return std::nullopt;  // it looks along the surface, or away from it
  double t_mm = chart.depth_mm / rise;
  Vector3d displaced_W = Vector3d::Zero();
  Basis motion_b = observation.b;
  motion_b(0) = 0.0;
  constexpr int kMostSteps = 20;
  constexpr double kNear_mm = 0.05;
  for (int step = 0; step < kMostSteps; ++step) {
    const SurfaceChart::Place place = chart.place_of(X_WC.t + t_mm * ray_W - displaced_W);
    if (!(place.depth_mm > 0.0)) return std::nullopt;
    const std::array<Vector2d, 1> places = {place.s};
    const PredictedPlaces there = surface.predict(places);
    const Vector3d mean_W = there.coefficients_W_mm.col(0);
    const Vector3d displaced_there_W = there.coefficients_W_mm * motion_b;
    const double off_mm = chart.place_of(mean_W).depth_mm - place.depth_mm;
    const double moved_mm = (displaced_there_W - displaced_W).norm();
    if (std::abs(off_mm) < kNear_mm && moved_mm < kNear_mm) return place.s;
    t_mm += off_mm / rise;
    displaced_W = displaced_there_W;
  }
  return std::nullopt;
}

}  // namespace

template <class Model>
SurfaceStart start_on_surface(const PeriodicSurface& surface, std::span<const Observation> observations,
                              const Model& model, const BatchSettings& settings) {
  SurfaceStart start;
  if (observations.empty() || observations.front().b.size() != surface.layout().size()) {
    start.kind = SurfaceStartKind::kUnusable;
    return start;
  }
  std::optional<Vector2d> s = place_of(surface, observations.front(), model);
  // A first match that is wrong shows another place than the others, and the surface is curved: where the feature is
  // found to be, it is asked for once more.
  constexpr int kMostRounds = 3;
  constexpr double kThere_mm = 0.3;
  for (int round = 0; s && round < kMostRounds; ++round) {
    const std::optional<FeaturePrior> prior = prior_at(surface, *s);
    if (!prior) break;
    PriorStart from_prior = start_from_prior(observations, model, *prior, settings);
    start.outcome = std::move(from_prior.outcome);
    const bool started =
        start.outcome.ok() && !start.outcome.contradicted() && from_prior.prior_misfit <= kContradictedPrior;
    start.kind = started ? SurfaceStartKind::kStarted : SurfaceStartKind::kContradicts;
    if (!start.outcome.ok()) return start;
    const StateVector& x = start.outcome.estimate.x;
    const Eigen::Index n = surface.layout().size();
    const SurfaceChart::Place found = surface.chart().place_of(Vector3d(x(0), x(n), x(2 * n)));
    if (!(found.depth_mm > 0.0) || (found.s - *s).norm() < kThere_mm) return start;
    s = found.s;
  }
  // Beside what is supported: that may be where the next surface goes on.
  if (start.kind == SurfaceStartKind::kStarted) start.kind = SurfaceStartKind::kNotThere;
  return start;
}

template SurfaceStart start_on_surface(const PeriodicSurface&, std::span<const Observation>, const PixelModel&,
                                       const BatchSettings&);
template SurfaceStart start_on_surface(const PeriodicSurface&, std::span<const Observation>, const BearingModel&,
                                       const BatchSettings&);

}  // namespace perimap
