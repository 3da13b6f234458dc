// What may be shown of a published surface, and nothing of what may not.
#pragma once

#include <perimap.h>
#include <perimap_mesh.h>

#include <array>
#include <cstdint>
#include <optional>
#include <perimap_mesh_client.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "daemon/subscribing/shown_tools.hpp"
#include "drivers/recording/cdr.hpp"

namespace perimap {

struct ShownFeature {
  std::uint32_t id = 0;
  perimap_FeatureState state = perimap_FEATURE_INVALID;  // of those that this program knows, but invalid
  std::array<double, 3> position_W_mm{};
  double deviation_mm = 0.0;  // the largest of the position, in any direction
};

// Of supported vertices alone: each is a corner of a triangle.
struct ShownMesh {
  std::vector<std::array<double, 3>> positions_W_mm;
  std::vector<double> deviations_mm;                    // not below the position's in any direction
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise from where the camera was
};

// One surface at its valid_time. Of one that is not usable all geometry is empty, whatever was published with it.
struct ShownSurface {
  perimap_SurfaceState state = perimap_SURFACE_INVALID;  // of features and mesh alike
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
  std::string why;  // why it is not good, for people; empty where it is
  std::string remedy;
  std::string why_no_mesh;  // empty where there is one, or nothing is shown

  std::string source;
  std::string frame_id;  // the name of W
  std::uint64_t sample_sequence = 0;
  std::uint64_t frame_sequence = 0;
  double phase_rad = 0.0;               // of the heart, at valid
  Instant capture, valid, valid_until;  // on the publisher's clock
  Duration utc_minus_monotonic{0};      // of that clock; zero: not told

  std::optional<Pose> X_WC;  // at capture; none where the pose of the camera is not known
  std::vector<ShownFeature> features;
  ShownMesh mesh;
  std::vector<ShownTool> tools;  // beside an unusable surface named alone

  [[nodiscard]] bool usable() const noexcept {
    return state == perimap_SURFACE_GOOD || state == perimap_SURFACE_DEGRADED;
  }
};

// The one gate that surfaces leave through for programs of others: keeps the newest model, mesh and tools of one
// source, and makes of each surface what may be shown of it. One thread.
class SurfaceGate {
 public:
  void take(Sample<perimap_SurfaceModel> model) { model_.emplace(std::move(model)); }
  void take(Sample<perimap_SurfaceMesh> mesh) { mesh_.emplace(std::move(mesh)); }
  void take(const perimap_ToolDistance& tool) { tools_.take(tool); }
  // Another publisher, or another instant of a recording: all are to come anew.
  void forget();
  // Null: none has come.
  [[nodiscard]] const perimap_SurfaceModel* model() const noexcept { return model_ ? &**model_ : nullptr; }
  [[nodiscard]] const perimap_SurfaceMesh* mesh() const noexcept { return mesh_ ? &**mesh_ : nullptr; }

  // `receipt`: when it came, on the publisher's clock, which is this host's or a recording's. After valid_until it came
  // too late, and is invalid. Features and mesh with figures that are no numbers are left out.
  [[nodiscard]] ShownSurface show(const perimap_Surface& surface, Instant receipt);

 private:
  void show_mesh(const perimap_Surface& surface, Instant receipt, ShownSurface& shown);

  std::optional<Sample<perimap_SurfaceModel>> model_;
  std::optional<Sample<perimap_SurfaceMesh>> mesh_;
  ShownTools tools_;
  client::PredictedMesh predicted_;
};

// Nothing of the surface, for a reason that is not perimapd's.
[[nodiscard]] ShownSurface show_nothing(const perimap_Surface& surface, std::string_view why, std::string_view remedy);

}  // namespace perimap
