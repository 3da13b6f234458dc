#include "daemon/view/messages/surface_teller.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <perimap_client.hpp>
#include <span>
#include <string>

#include "daemon/publishing/advice.hpp"
#include "daemon/publishing/tool_text.hpp"
#include "daemon/publishing/use_text.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "daemon/view/messages/milliseconds.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

// To 0.01, which is finer than a page draws, so that messages stay small. No number is null.
Json rounded(double value) { return std::isfinite(value) ? Json(std::round(value * 100.0) / 100.0) : Json(nullptr); }

double largest_deviation_mm(const double (&c)[6]) {
  Eigen::Matrix3d covariance;
  covariance << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  if (!covariance.allFinite()) return std::nan("");
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(2)));
}

// Where the scope was; with its lens where that is told (an older perimapd does not).
Json camera_json(const perimap_Surface& surface) {
  const auto finite = [](const auto& values) {
    return std::all_of(std::begin(values), std::end(values), [](double value) { return std::isfinite(value); });
  };
  if (!surface.camera_pose_known || !finite(surface.translation_WC_mm) || !finite(surface.rotation_WC_wxyz)) {
    return nullptr;
  }
  const auto list = [](const auto& values) {
    Json json = Json::array();
    for (const double value : values) json.push_back(value);
    return json;
  };
  Json json = {{"translation_mm", list(surface.translation_WC_mm)},
               {"rotation_wxyz", list(surface.rotation_WC_wxyz)},
               {"focal_px", nullptr},
               {"principal_point_px", nullptr}};
  if (surface.camera_focal_px[0] > 0 && surface.camera_focal_px[1] > 0 && finite(surface.camera_focal_px) &&
      finite(surface.camera_principal_point_px)) {
    json["focal_px"] = list(surface.camera_focal_px);
    json["principal_point_px"] = list(surface.camera_principal_point_px);
  }
  return json;
}

// NOLINTNEXTLINE(bugprone-exception-escape): the move constructor of nlohmann::json only asserts
struct Told {
  Json features;
  std::size_t converged = 0;  // of them
};

// Those whose numbers can be drawn.
Told features_of(const perimap_Surface& surface) {
  Told told;
  Json ids = Json::array(), positions = Json::array(), states = Json::array(), deviations = Json::array();
  for (const perimap_SurfaceFeature& feature : std::span(surface.features._buffer, surface.features._length)) {
    if (feature.state == perimap_FEATURE_INVALID) continue;
    const double deviation_mm = largest_deviation_mm(feature.covariance_W_mm2);
    const double* p = feature.position_W_mm;
    if (!std::isfinite(p[0] + p[1] + p[2]) || !std::isfinite(deviation_mm)) continue;
    if (feature.state == perimap_FEATURE_CONVERGED) ++told.converged;
    ids.push_back(feature.id);
    for (std::size_t axis = 0; axis < 3; ++axis) positions.push_back(rounded(p[axis]));
    states.push_back(static_cast<int>(feature.state));
    deviations.push_back(rounded(deviation_mm));
  }
  told.features = {{"ids", std::move(ids)},
                   {"positions_mm", std::move(positions)},
                   {"states", std::move(states)},
                   {"deviations_mm", std::move(deviations)}};
  return told;
}

Json place_json(const std::array<double, 3>& place) {
  return {rounded(place[0]), rounded(place[1]), rounded(place[2])};
}

Json tools_json(const std::vector<ShownTool>& tools) {
  Json list = Json::array();
  for (const ShownTool& tool : tools) {
    const client::ToolAtInstant& at = tool.at;
    const bool good = at.refusal == client::ToolRefusal::kNone && at.state == perimap_TOOL_GOOD;
    list.push_back({{"tool", tool.name},
                    {"state", tool_state_name(at.state)},
                    {"why", good ? "" : client::describe(at)},
                    {"touches", at.touches},
                    {"distance_mm", rounded(at.distance_mm)},
                    {"deviation_mm", rounded(at.deviation_mm)},
                    {"rate_mm_per_s", rounded(at.rate_mm_per_s)},
                    {"tip_mm", at.tip_known ? place_json(at.tip_W_mm) : Json(nullptr)},
                    {"nearest_mm", tool.nearest_W_mm ? place_json(*tool.nearest_W_mm) : Json(nullptr)}});
  }
  return list;
}

}  // namespace

void SurfaceTeller::forget() {
  model_.reset();
  mesh_.reset();
  tools_.forget();
}

Json SurfaceTeller::mesh_at(const perimap_Surface& surface, Instant receipt) {
  if (!model_ || !mesh_) return {{"words", "no surface has come yet"}};
  if (!client::predict(**mesh_, **model_, surface, to_ns(receipt), {true}, predicted_)) {
    return {{"words", client::describe(predicted_)}};
  }
  Json positions = Json::array(), deviations = Json::array(), triangles = Json::array();
  for (const auto& position : predicted_.positions_W_mm) {
    for (const double coordinate : position) positions.push_back(rounded(coordinate));
  }
  for (const double deviation : predicted_.deviations_mm) deviations.push_back(rounded(deviation));
  for (const auto& triangle : predicted_.triangles) {
    for (const std::uint32_t corner : triangle) triangles.push_back(corner);
  }
  const bool good = predicted_.state == perimap_SURFACE_GOOD;
  return {{"words", good ? "" : client::describe(predicted_.reason)},
          {"state", name_of(predicted_.state)},
          {"positions_mm", std::move(positions)},
          {"deviations_mm", std::move(deviations)},
          {"triangles", std::move(triangles)}};
}

Json SurfaceTeller::tell(const perimap_Surface& surface, Instant receipt) {
  const bool usable = surface.state == perimap_SURFACE_GOOD || surface.state == perimap_SURFACE_DEGRADED;
  Told told = features_of(surface);
  const std::optional<ToldUses> uses = uses_of(surface);
  Json json = {{"kind", "surface"},
               {"source", surface.source},
               {"stream", surface.stream},
               {"sequence", surface.sample_sequence},
               {"frame", surface.frame_sequence},
               {"state", name_of(surface.state)},
               {"reason", name_of(surface.reason)},
               {"permission", permission_of(surface.state)},
               {"why", surface.reason == perimap_SURFACE_REASON_NONE ? "" : client::describe(surface.reason)},
               {"remedy", remedy_of(surface.reason)},
               {"uses", uses ? uses_json(*uses) : Json(nullptr)},
               {"converged", told.converged},
               {"known", surface.features._length},
               {"valid_ms", page_ms(surface.valid_time_ns)},
               {"capture_ms", page_ms(surface.capture_time_ns)},
               {"received_ms", page_ms(to_ns(receipt))},
               {"valid_for_ms", page_ms(surface.valid_until_ns) - page_ms(to_ns(receipt))},
               {"phase_rad", rounded(surface.cardiac_phase_rad)},
               {"phase_deviation_rad", rounded(surface.cardiac_phase_deviation_rad)}};
  json["tools"] = tools_json(tools_.at(from_ns(surface.valid_time_ns), receipt, surface.state));
  if (!usable) return json;
  json["camera"] = camera_json(surface);
  json["features"] = std::move(told.features);
  json["mesh"] = mesh_at(surface, receipt);
  return json;
}

}  // namespace perimap
