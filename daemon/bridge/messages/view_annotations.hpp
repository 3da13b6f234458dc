// A surface over the picture of its frame.
#pragma once

#include <foxglove_view.h>
#include <perimap.h>
#include <perimap_mesh.h>

#include <optional>
#include <perimap_mesh_client.hpp>
#include <string>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "daemon/subscribing/picture_projector.hpp"
#include "daemon/subscribing/shown_surface.hpp"

namespace perimap {

// Keeps its memory from one surface to the next.
class ViewAnnotations {
 public:
  // What the surface is worth in words, and where it may be shown the features and the outline of the mesh, where model
  // and mesh predict them for the capture of its frame. Pixels count from the corner of the first one. Stamped with
  // `utc`, that of the capture. Borrowed until the next call.
  [[nodiscard]] const foxglove_ImageAnnotations& of(const perimap_Surface& surface, const ShownSurface& shown,
                                                    const SurfaceGate& gate, const std::optional<CameraModel>& lens,
                                                    Instant receipt, Instant utc);

 private:
  // `scale`: of this picture beside one of the usual width.
  void add_words(const ShownSurface& shown, double scale, Instant utc);
  void add_features(const PictureProjector& project, double scale, Instant utc);
  void add_outline(const PictureProjector& project, const ShownSurface& shown, double scale, Instant utc);

  foxglove_ImageAnnotations annotations_{};
  std::vector<foxglove_CircleAnnotation> circles_;
  std::vector<foxglove_PointsAnnotation> lines_;
  std::vector<foxglove_Point2> outline_;
  std::vector<foxglove_TextAnnotation> texts_;
  std::string words_;
  client::PredictedSurface features_;
  client::PredictedMesh mesh_;
};

}  // namespace perimap
