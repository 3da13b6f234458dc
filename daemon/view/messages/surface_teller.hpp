// A surface as the page gets it: what may be used, and no position of what may not.
#pragma once

#include <perimap.h>
#include <perimap_mesh.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <perimap_mesh_client.hpp>

#include "core/time/instant.hpp"
#include "daemon/subscribing/shown_tools.hpp"
#include "drivers/recording/cdr.hpp"

namespace perimap {

// Keeps the newest model, mesh and tools of one perimapd, and moves the mesh to the instant of each surface. One
// thread.
class SurfaceTeller {
 public:
  void hear(Sample<perimap_SurfaceModel> model) { model_.emplace(std::move(model)); }
  void hear(Sample<perimap_SurfaceMesh> mesh) { mesh_.emplace(std::move(mesh)); }
  void hear(const perimap_ToolDistance& tool) { tools_.take(tool); }
  // Another instant of a recording: all are to come anew.
  void forget();
  // Null: none has come.
  [[nodiscard]] const perimap_SurfaceModel* model() const noexcept { return model_ ? &**model_ : nullptr; }
  [[nodiscard]] const perimap_SurfaceMesh* mesh() const noexcept { return mesh_ ? &**mesh_ : nullptr; }

  // `receipt` is when it came; on the publisher's clock, which is this host's or a recording's. "valid_for_ms" counts
  // from there, and is not above zero when it came too late. Lengths in mm, times in ms of that clock. Positions of an
  // invalid surface are left out, and so is a mesh that the client of idl/perimap_mesh_client.hpp refuses.
  [[nodiscard]] nlohmann::ordered_json tell(const perimap_Surface& surface, Instant receipt);

 private:
  [[nodiscard]] nlohmann::ordered_json mesh_at(const perimap_Surface& surface, Instant receipt);

  std::optional<Sample<perimap_SurfaceModel>> model_;
  std::optional<Sample<perimap_SurfaceMesh>> mesh_;
  ShownTools tools_;
  client::PredictedMesh predicted_;
};

}  // namespace perimap
