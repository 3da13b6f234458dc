#include "daemon/bridge/messages/view_scene.hpp"

#include <algorithm>

#include "daemon/bridge/messages/lent.hpp"
#include "daemon/bridge/messages/view_camera.hpp"
#include "daemon/bridge/messages/view_colours.hpp"
#include "daemon/bridge/messages/view_names.hpp"
#include "daemon/bridge/messages/view_units.hpp"
#include "daemon/publishing/tool_text.hpp"
#include "daemon/subscribing/any_time.hpp"
#include "drivers/recording/foxglove_image.hpp"

namespace perimap {
namespace {

constexpr std::int64_t kLongest_ns = 10'000'000'000;  // whatever a surface says of itself
constexpr double kSphere_mm = 1.5;
constexpr double kTip_mm = 3.0;
constexpr double kToolText_px = 16.0;
constexpr double kFrustumDepth_mm = 25.0;
constexpr double kFrustumLine_px = 1.5;
constexpr foxglove_Color kFrustumColour{0.6, 0.7, 0.9, 1.0};

}  // namespace

foxglove_SceneEntity ViewScene::entity(const char* id, Instant utc, const std::string& frame,
                                       const ShownSurface& surface) const {
  foxglove_SceneEntity entity{};
  entity.timestamp = to_foxglove_time(utc);
  entity.frame_id = lent(frame);
  entity.id = lent(id);
  const std::int64_t lifetime =
      std::clamp<std::int64_t>(wrapped_difference(to_ns(surface.valid_until), to_ns(surface.valid)), 1, kLongest_ns);
  entity.lifetime = {static_cast<std::int32_t>(lifetime / 1'000'000'000),
                     static_cast<std::uint32_t>(lifetime % 1'000'000'000)};
  return entity;
}

void ViewScene::add_mesh(const ShownSurface& surface) {
  const ShownMesh& mesh = surface.mesh;
  for (std::size_t v = 0; v < mesh.positions_W_mm.size(); ++v) {
    vertices_.push_back(metres(mesh.positions_W_mm[v]));
    vertex_colours_.push_back(colour_of(surface.state, mesh.deviations_mm[v]));
  }
  for (const auto& triangle : mesh.triangles) indices_.insert(indices_.end(), triangle.begin(), triangle.end());
  auto& list = triangles_.emplace_back();
  list.pose = no_pose();
  list.color = colour_of(surface.state, 0.0);
  lend(vertices_, list.points);
  lend(vertex_colours_, list.colors);
  lend(indices_, list.indices);
}

void ViewScene::add_features(const ShownSurface& surface) {
  constexpr double kDiameter = kSphere_mm * kMetresPerMillimetre;
  for (const ShownFeature& feature : surface.features) {
    auto& sphere = spheres_.emplace_back();
    sphere.pose = no_pose();
    const foxglove_Point3 at = metres(feature.position_W_mm);
    sphere.pose.position = {at.x, at.y, at.z};
    sphere.size = {kDiameter, kDiameter, kDiameter};
    sphere.color = colour_of(feature.state);
  }
}

// A tip without a distance is drawn too: its words say why there is none.
void ViewScene::add_tools(const ShownSurface& surface) {
  constexpr double kDiameter = kTip_mm * kMetresPerMillimetre;
  for (const ShownTool& tool : surface.tools) {
    if (!tool.at.tip_known) continue;
    const foxglove_Point3 tip = metres(tool.at.tip_W_mm);
    const foxglove_Color colour = colour_of_tool(tool.at.touches);
    auto& sphere = tips_.emplace_back();
    sphere.pose = no_pose();
    sphere.pose.position = {tip.x, tip.y, tip.z};
    sphere.size = {kDiameter, kDiameter, kDiameter};
    sphere.color = colour;
    tool_words_.push_back(tool_words(tool.name, tool.at));
    auto& text = tool_texts_.emplace_back();
    text.pose = sphere.pose;
    text.billboard = text.scale_invariant = true;
    text.font_size = kToolText_px;
    text.color = colour;
    if (tool.nearest_W_mm) ways_.insert(ways_.end(), {tip, metres(*tool.nearest_W_mm)});
  }
  for (std::size_t i = 0; i < tool_texts_.size(); ++i) tool_texts_[i].text = lent(tool_words_[i]);
  if (ways_.empty()) return;
  auto& line = tool_lines_.emplace_back();
  line.type = foxglove_LINE_LIST;
  line.pose = no_pose();
  line.thickness = kFrustumLine_px;
  line.scale_invariant = true;
  line.color = colour_of_tool(false);
  lend(ways_, line.points);
}

// From the camera through the corners of its picture.
void ViewScene::add_frustum(const CameraModel& lens) {
  const auto corner = [&lens](double u, double v) {
    return metres(std::array{(u - lens.cx) / lens.fx * kFrustumDepth_mm, (v - lens.cy) / lens.fy * kFrustumDepth_mm,
                             kFrustumDepth_mm});
  };
  const double right = lens.width - 0.5;
  const double bottom = lens.height - 0.5;
  const std::array corners{corner(-0.5, -0.5), corner(right, -0.5), corner(right, bottom), corner(-0.5, bottom)};
  for (std::size_t k = 0; k < corners.size(); ++k) {
    edges_.insert(edges_.end(), {foxglove_Point3{}, corners[k], corners[k], corners[(k + 1) % corners.size()]});
  }
  auto& line = lines_.emplace_back();
  line.type = foxglove_LINE_LIST;
  line.pose = no_pose();
  line.thickness = kFrustumLine_px;
  line.scale_invariant = true;
  line.color = kFrustumColour;
  lend(edges_, line.points);
}

const foxglove_SceneUpdate& ViewScene::of(const ShownSurface& surface, Instant utc, const std::string& world_frame,
                                          const std::optional<CameraModel>& lens) {
  static const std::string camera_frame = view_names::kCameraFrame;
  update_ = {};
  entities_.clear();
  deletions_.clear();
  vertices_.clear();
  vertex_colours_.clear();
  indices_.clear();
  triangles_.clear();
  spheres_.clear();
  tips_.clear();
  ways_.clear();
  tool_lines_.clear();
  tool_words_.clear();
  tool_texts_.clear();
  edges_.clear();
  lines_.clear();
  if (!surface.usable()) {
    auto& all = deletions_.emplace_back();
    all.timestamp = to_foxglove_time(utc);
    all.type = foxglove_ALL;
    all.id = lent("");
    lend(deletions_, update_.deletions);
    return update_;
  }
  auto& shape = entities_.emplace_back(entity("surface", utc, world_frame, surface));
  if (!surface.mesh.triangles.empty()) add_mesh(surface);
  lend(triangles_, shape.triangles);
  auto& features = entities_.emplace_back(entity("features", utc, world_frame, surface));
  add_features(surface);
  lend(spheres_, features.spheres);
  if (!surface.tools.empty()) {
    auto& tools = entities_.emplace_back(entity("tools", utc, world_frame, surface));
    add_tools(surface);
    lend(tips_, tools.spheres);
    lend(tool_lines_, tools.lines);
    lend(tool_texts_, tools.texts);
  }
  if (surface.X_WC && lens) {
    auto& frustum = entities_.emplace_back(entity("camera", utc, camera_frame, surface));
    frustum.frame_locked = true;
    add_frustum(*lens);
    lend(lines_, frustum.lines);
  }
  lend(entities_, update_.entities);
  return update_;
}

}  // namespace perimap
