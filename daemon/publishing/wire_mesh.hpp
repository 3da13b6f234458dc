// The surface's mesh as the wire type of idl/perimap_mesh.idl. Not for the real-time path: it allocates.
#pragma once

#include <perimap_mesh.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/time/instant.hpp"
#include "daemon/publishing/identity.hpp"

namespace perimap {

struct MadeSurface;
struct SurfaceMesh;
class SurfaceMaker;

// Owns the buffers that its message points to.
class WireMesh {
 public:
  explicit WireMesh(const Identity& identity);

  // A sample when there is something that the last one did not say: another surface, or none any more. Valid until the
  // next call. `now` is the time of a sample that says that there is none.
  [[nodiscard]] const perimap_SurfaceMesh* news(SurfaceMaker& maker, Instant now, Duration utc_minus_monotonic);

 private:
  void fill(const MadeSurface& made);
  void fill_numbers(const SurfaceMesh& mesh);
  void say_none(std::uint8_t reason);

  std::shared_ptr<const MadeSurface> told_;
  bool any_told_ = false;
  std::vector<std::uint8_t> vertex_states_;
  std::vector<float> coefficients_;
  std::vector<float> covariances_;
  std::vector<std::uint32_t> triangles_;
  perimap_SurfaceMesh wire_{};
};

}  // namespace perimap
