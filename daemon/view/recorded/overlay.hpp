// The predicted surface over the camera's picture.
#pragma once

#include <perimap.h>
#include <perimap_mesh.h>

#include <nlohmann/json.hpp>

#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Mesh and features at the capture of the surface's frame, as model and mesh predict them, in pixels of that picture
// through `lens`; the focal lengths and principal point are the surface's own where it tells them. Null where nothing
// may be drawn: the surface is invalid, its scope's pose is not known, or the predictions are refused. `model` and
// `mesh` may be null; of what is not there nothing is drawn.
[[nodiscard]] nlohmann::ordered_json overlay_json(const perimap_Surface& surface, const perimap_SurfaceModel* model,
                                                  const perimap_SurfaceMesh* mesh, const CameraModel& lens,
                                                  Instant now);

}  // namespace perimap
