// A surface as a scene in three dimensions.
#pragma once

#include <foxglove_view.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "daemon/subscribing/shown_surface.hpp"

namespace perimap {

// Keeps its memory from one surface to the next.
class ViewScene {
 public:
  // The mesh, the features as spheres, the tips of tracked tools, each with its distance in words and a line to the
  // nearest place of the surface, and in the camera's frame what it sees. Of a surface that may not be shown:
  // everything that was shown before is taken away. Stamped with `utc`, that of the surface's valid_time; without
  // another message it goes by itself when the surface's valid_until has passed. Borrowed until the next call.
  [[nodiscard]] const foxglove_SceneUpdate& of(const ShownSurface& surface, Instant utc, const std::string& world_frame,
                                               const std::optional<CameraModel>& lens);

 private:
  foxglove_SceneEntity entity(const char* id, Instant utc, const std::string& frame, const ShownSurface& surface) const;
  void add_mesh(const ShownSurface& surface);
  void add_features(const ShownSurface& surface);
  void add_tools(const ShownSurface& surface);
  void add_frustum(const CameraModel& lens);

  foxglove_SceneUpdate update_{};
  std::vector<foxglove_SceneEntity> entities_;
  std::vector<foxglove_SceneEntityDeletion> deletions_;
  std::vector<foxglove_Point3> vertices_;
  std::vector<foxglove_Color> vertex_colours_;
  std::vector<std::uint32_t> indices_;
  std::vector<foxglove_TriangleListPrimitive> triangles_;
  std::vector<foxglove_SpherePrimitive> spheres_;
  std::vector<foxglove_SpherePrimitive> tips_;
  std::vector<foxglove_Point3> ways_;  // from each tip to the surface
  std::vector<foxglove_LinePrimitive> tool_lines_;
  std::vector<std::string> tool_words_;
  std::vector<foxglove_TextPrimitive> tool_texts_;
  std::vector<foxglove_Point3> edges_;
  std::vector<foxglove_LinePrimitive> lines_;
};

}  // namespace perimap
