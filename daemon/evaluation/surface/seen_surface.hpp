// Material points drawn on a simulated heart, and which of them the camera has seen.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/truth/ground_truth.hpp"

namespace perimap {

// Drawn evenly over the mean shape's area, always the same for a mesh. A point is seen once it was on the sensor, with
// nothing of the heart before it, in three looks; it is seen well once three of them foreshortened it twofold at most
// (60 degrees), as no feature can be followed through much more. Instruments and smoke are not known here: what they
// hide counts as seen.
class SeenSurface {
 public:
  // `truth` must outlive it.
  SeenSurface(const GroundTruth& truth, const CameraModel& camera);

  // The frame captured then; nothing where the truth has no camera of that instant.
  void look(Instant capture);

  // Points that have been seen, by their number, in the order in which they were.
  [[nodiscard]] const std::vector<std::size_t>& seen() const noexcept { return seen_; }
  // Of the seen ones, which are met first by the rays from a place (W) to the mean shape. What lies behind something is
  // not in a chart of what is seen from there.
  [[nodiscard]] std::vector<bool> in_front_of(const Vector3d& place_W) const;
  [[nodiscard]] bool seen_well(std::size_t point) const noexcept;
  // It, or some point within 5 mm of it, is not seen well.
  [[nodiscard]] bool on_rim(std::size_t point) const noexcept;

  // Mean over the cardiac cycle and over breaths, mm, W.
  [[nodiscard]] const Vector3d& mean_place(std::size_t point) const noexcept { return mean_places_[point]; }
  // From all vertices as they are at an instant (GroundTruth::vertices_at).
  [[nodiscard]] Vector3d position(std::size_t point, const std::vector<Vector3d>& vertices) const noexcept;

 private:
  void draw_points();
  // Whether the ray from the origin to the point meets nothing before it.
  [[nodiscard]] bool is_first(std::size_t point, const std::vector<Vector3d>& vertices,
                              const SurfaceView& view) const noexcept;
  void find_neighbours();
  enum class Sight : std::uint8_t { kNone, kOblique, kWell };
  [[nodiscard]] Sight sight_of(std::size_t point, const std::vector<Vector3d>& vertices_C,
                               const SurfaceView& view) const noexcept;

  const GroundTruth& truth_;
  CameraModel camera_;
  std::vector<SurfacePoint> points_;
  std::vector<Vector3d> mean_vertices_;
  std::vector<Vector3d> mean_places_;
  std::vector<std::vector<std::uint32_t>> neighbours_;  // within 5 mm
  std::vector<int> sightings_;
  std::vector<int> good_sightings_;  // of those
  std::vector<std::size_t> seen_;
};

}  // namespace perimap
