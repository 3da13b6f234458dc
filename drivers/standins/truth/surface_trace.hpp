// How a recorded trace moves a simulated surface: each place by a weighted mean of the trace's points.
#pragma once

#include <cstdint>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct SurfaceTrace {
  Instant first;       // sample
  Duration period{0};  // between samples
  double reach_mm = 0.0;
  std::vector<Vector3d> places_W;         // of the points, on the surface at rest
  std::vector<Vector3d> displacements_W;  // mm; of each sample those of all points, from their means

  [[nodiscard]] bool empty() const noexcept { return displacements_W.empty(); }
};

// Four samples, a period and a reach above zero, finite numbers, as many displacements a sample as points; the error
// names what is not. An empty trace is sound: nothing moves by it.
[[nodiscard]] Expected<void> check(const SurfaceTrace& trace);

// Where the trace's points are at one instant.
class TracedPlace {
 public:
  // Needs a checked trace that is not empty; it must outlive this. Between samples a cubic through the two on either
  // side (Catmull & Rom 1974), so that velocity is continuous; before the first and after the last they stay.
  TracedPlace(const SurfaceTrace& trace, Instant t);

  // Of a point of the surface that is at rest_W at rest, mm.
  [[nodiscard]] Vector3d displacement(const Vector3d& rest_W) const noexcept;

 private:
  const SurfaceTrace& trace_;
  std::vector<Vector3d> now_W_;
};

}  // namespace perimap
