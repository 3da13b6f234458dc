#include "daemon/subscribing/shown_surface.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "daemon/publishing/advice.hpp"
#include "daemon/subscribing/any_time.hpp"

namespace perimap {
namespace {

template <class Values>
bool all_finite(const Values& values) {
  return std::all_of(std::begin(values), std::end(values), [](double value) { return std::isfinite(value); });
}

ShownSurface facts_of(const perimap_Surface& surface) {
  ShownSurface shown;
  shown.source = surface.source;
  shown.frame_id = surface.frame_id;
  shown.sample_sequence = surface.sample_sequence;
  shown.frame_sequence = surface.frame_sequence;
  shown.phase_rad = surface.cardiac_phase_rad;
  shown.capture = from_ns(surface.capture_time_ns);
  shown.valid = from_ns(surface.valid_time_ns);
  shown.valid_until = from_ns(surface.valid_until_ns);
  if (surface.release_utc_ns > 0) {
    shown.utc_minus_monotonic = Duration(wrapped_difference(surface.release_utc_ns, surface.release_time_ns));
  }
  return shown;
}

std::optional<Pose> camera_of(const perimap_Surface& surface) {
  if (!surface.camera_pose_known || !all_finite(surface.translation_WC_mm) || !all_finite(surface.rotation_WC_wxyz)) {
    return std::nullopt;
  }
  const auto square = [](double sum, double value) { return sum + value * value; };
  const double norm2 =
      std::accumulate(std::begin(surface.rotation_WC_wxyz), std::end(surface.rotation_WC_wxyz), 0.0, square);
  if (!(norm2 > 0.25 && norm2 < 4.0)) return std::nullopt;  // no rotation
  const double* t = surface.translation_WC_mm;
  return pose_from_wxyz(Vector3d(t[0], t[1], t[2]), surface.rotation_WC_wxyz);
}

bool may_be_shown(perimap_FeatureState state) {
  return state == perimap_FEATURE_CONVERGING || state == perimap_FEATURE_CONVERGED ||
         state == perimap_FEATURE_INCONSISTENT;
}

std::vector<ShownFeature> features_of(const perimap_Surface& surface) {
  std::vector<ShownFeature> features;
  for (const perimap_SurfaceFeature& feature : std::span(surface.features._buffer, surface.features._length)) {
    if (!may_be_shown(feature.state) || !all_finite(feature.position_W_mm)) continue;
    std::array<double, 6> covariance{};
    std::copy_n(feature.covariance_W_mm2, covariance.size(), covariance.begin());
    if (!all_finite(covariance) || std::min({covariance[0], covariance[3], covariance[5]}) < 0.0) continue;
    const double variance_mm2 = std::max(client::detail::largest_eigenvalue(covariance), 0.0);
    if (!std::isfinite(variance_mm2)) continue;
    const double* p = feature.position_W_mm;
    features.push_back({feature.id, feature.state, {p[0], p[1], p[2]}, std::sqrt(variance_mm2)});
  }
  return features;
}

ShownMesh supported(const client::PredictedMesh& predicted) {
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  ShownMesh mesh;
  std::vector<std::uint32_t> place(predicted.positions_W_mm.size(), kNone);
  mesh.triangles.reserve(predicted.triangles.size());
  for (const auto& corners : predicted.triangles) {
    auto& triangle = mesh.triangles.emplace_back();
    for (std::size_t k = 0; k < corners.size(); ++k) {
      std::uint32_t& vertex = place[corners[k]];
      if (vertex == kNone) {
        vertex = static_cast<std::uint32_t>(mesh.positions_W_mm.size());
        mesh.positions_W_mm.push_back(predicted.positions_W_mm[corners[k]]);
        mesh.deviations_mm.push_back(predicted.deviations_mm[corners[k]]);
      }
      triangle[k] = vertex;
    }
  }
  return mesh;
}

}  // namespace

void SurfaceGate::forget() {
  model_.reset();
  mesh_.reset();
  tools_.forget();
}

void SurfaceGate::show_mesh(const perimap_Surface& surface, Instant receipt, ShownSurface& shown) {
  if (!model_ || !mesh_) {
    shown.why_no_mesh = "no mesh has come yet";
    return;
  }
  if (!client::predict(**mesh_, **model_, surface, to_ns(receipt), {true}, predicted_)) {
    shown.why_no_mesh = client::describe(predicted_);
    return;
  }
  shown.mesh = supported(predicted_);
}

ShownSurface SurfaceGate::show(const perimap_Surface& surface, Instant receipt) {
  if (receipt > from_ns(surface.valid_until_ns)) return show_nothing(surface, "the surface came too late", "");
  ShownSurface shown = facts_of(surface);
  shown.state = surface.state;
  shown.reason = surface.reason;
  if (shown.usable()) {
    shown.X_WC = camera_of(surface);
    shown.features = features_of(surface);
    show_mesh(surface, receipt, shown);
  } else {
    shown.state = perimap_SURFACE_INVALID;  // also one that this program does not know
  }
  shown.tools = tools_.at(shown.valid, receipt, shown.state);
  if (shown.state != perimap_SURFACE_GOOD) {
    shown.why = client::describe(shown.reason);
    shown.remedy = remedy_of(shown.reason);
  }
  return shown;
}

ShownSurface show_nothing(const perimap_Surface& surface, std::string_view why, std::string_view remedy) {
  ShownSurface shown = facts_of(surface);
  shown.why = why;
  shown.remedy = remedy;
  return shown;
}

}  // namespace perimap
