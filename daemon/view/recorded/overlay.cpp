#include "daemon/view/recorded/overlay.hpp"

#include <cmath>
#include <perimap_mesh_client.hpp>
#include <vector>

#include "daemon/subscribing/picture_projector.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

double tenth(double value) { return std::round(value * 10.0) / 10.0; }

void put_mesh(const client::PredictedMesh& mesh, const PictureProjector& project, Json& json) {
  std::vector<bool> seen;
  Json vertices = Json::array(), deviations = Json::array(), triangles = Json::array();
  for (std::size_t v = 0; v < mesh.positions_W_mm.size(); ++v) {
    const auto px = project(mesh.positions_W_mm[v]);
    seen.push_back(px.has_value());
    vertices.push_back(px ? tenth(px->x()) : 0.0);
    vertices.push_back(px ? tenth(px->y()) : 0.0);
    deviations.push_back(std::round(mesh.deviations_mm[v] * 100.0) / 100.0);
  }
  for (const auto& triangle : mesh.triangles) {
    if (!seen[triangle[0]] || !seen[triangle[1]] || !seen[triangle[2]]) continue;
    for (const std::uint32_t corner : triangle) triangles.push_back(corner);
  }
  json["vertices_px"] = std::move(vertices);
  json["deviations_mm"] = std::move(deviations);
  json["triangles"] = std::move(triangles);
}

void put_features(const client::PredictedSurface& surface, const PictureProjector& project, Json& json) {
  Json features = Json::array(), ids = Json::array(), states = Json::array();
  for (const client::PredictedFeature& feature : surface.features) {
    const auto px = project(feature.position_W_mm);
    if (!px || feature.state == perimap_FEATURE_INVALID) continue;
    features.push_back(tenth(px->x()));
    features.push_back(tenth(px->y()));
    ids.push_back(feature.id);
    states.push_back(static_cast<int>(feature.state));
  }
  json["features_px"] = std::move(features);
  json["feature_ids"] = std::move(ids);
  json["feature_states"] = std::move(states);
}

}  // namespace

Json overlay_json(const perimap_Surface& surface, const perimap_SurfaceModel* model, const perimap_SurfaceMesh* mesh,
                  const CameraModel& lens, Instant now) {
  const bool usable = surface.state == perimap_SURFACE_GOOD || surface.state == perimap_SURFACE_DEGRADED;
  if (!usable || !surface.camera_pose_known || model == nullptr) return nullptr;
  const PictureProjector project(surface, lens);
  Json json = Json::object();
  client::PredictedSurface features;
  if (!client::predict(*model, surface.capture_time_ns, to_ns(now), {true}, features)) return nullptr;
  put_features(features, project, json);
  client::PredictedMesh predicted;
  if (mesh != nullptr && client::predict(*mesh, *model, surface.capture_time_ns, to_ns(now), {true}, predicted)) {
    put_mesh(predicted, project, json);
  }
  return json;
}

}  // namespace perimap
