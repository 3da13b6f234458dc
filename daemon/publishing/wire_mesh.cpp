#include "daemon/publishing/wire_mesh.hpp"

#include <algorithm>

#include "core/pipeline/mesh_validity.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "daemon/publishing/wire_states.hpp"
#include "daemon/publishing/wire_text.hpp"

namespace perimap {
namespace {

std::uint8_t reason_of(SurfaceRefusalKind kind) noexcept {
  switch (kind) {
    case SurfaceRefusalKind::kTooFewFeatures:
      return perimap_MESH_REASON_TOO_FEW_FEATURES;
    case SurfaceRefusalKind::kOnALine:
      return perimap_MESH_REASON_ON_A_LINE;
    case SurfaceRefusalKind::kNoKernel:
      return perimap_MESH_REASON_NOT_SMOOTH;
    case SurfaceRefusalKind::kNotANumber:
    case SurfaceRefusalKind::kBehindCamera:
      break;
  }
  return perimap_MESH_REASON_UNUSABLE;
}

template <class Sequence, class T>
void point_to(Sequence& sequence, std::vector<T>& values) noexcept {
  const auto n = static_cast<std::uint32_t>(values.size());
  sequence = {n, n, values.data(), false};
}

}  // namespace

WireMesh::WireMesh(const Identity& identity) {
  copy_text(identity.source, wire_.source);
  copy_text(identity.frame_id, wire_.frame_id);
  std::copy(identity.run_id.begin(), identity.run_id.end(), wire_.run_id);
}

const perimap_SurfaceMesh* WireMesh::news(SurfaceMaker& maker, Instant now, Duration utc_minus_monotonic) {
  std::shared_ptr<const MadeSurface> newest = maker.newest();
  if (any_told_ && newest == told_) return nullptr;
  any_told_ = true;
  told_ = std::move(newest);
  wire_.time_ns = to_ns(now);
  wire_.frame_sequence = 0;
  if (told_ == nullptr) {
    say_none(maker.withdrawn() ? perimap_MESH_REASON_MAP_CHANGED : perimap_MESH_REASON_NOT_YET);
  } else {
    fill(*told_);
  }
  wire_.time_utc_ns = wire_.time_ns + utc_minus_monotonic.count();
  wire_.valid_until_ns = wire_.time_ns + Duration(kMeshValid).count();
  ++wire_.sample_sequence;
  return &wire_;
}

void WireMesh::fill(const MadeSurface& made) {
  if (!made.surface) {
    say_none(reason_of(made.refusal.kind));
  } else if (made.mesh.triangles.empty()) {
    say_none(made.of_model ? perimap_MESH_REASON_NOT_THE_MODEL : perimap_MESH_REASON_NOTHING_SUPPORTED);
  } else {
    wire_.state = perimap_MESH_THERE;
    wire_.reason = perimap_MESH_REASON_NONE;
    wire_.features = static_cast<std::uint32_t>(made.surface->features());
    wire_.features_contradicting = static_cast<std::uint32_t>(made.surface->contradicted().size());
    wire_.leave_one_out_rms_mm = made.surface->agreement().rms_mm;
    wire_.leave_one_out_nees = made.surface->agreement().nees;
    fill_numbers(made.mesh);
  }
  wire_.time_ns = to_ns(made.capture);
  wire_.frame_sequence = made.frame_sequence;
  wire_.phase_law = static_cast<std::uint8_t>(to_wire(made.law));
}

void WireMesh::fill_numbers(const SurfaceMesh& mesh) {
  const auto V = static_cast<std::size_t>(mesh.vertices());
  const auto B = static_cast<std::size_t>(mesh.layout.size());
  wire_.cardiac_harmonics = static_cast<std::uint32_t>(mesh.layout.cardiac_harmonics);
  wire_.respiratory_harmonics = static_cast<std::uint32_t>(mesh.layout.respiratory_harmonics);
  vertex_states_.resize(V);
  coefficients_.resize(3 * B * V);
  covariances_.resize(6 * V);
  triangles_.clear();
  for (std::size_t v = 0; v < V; ++v) {
    const bool supported = mesh.support[v] == Support::kSupported;
    vertex_states_[v] = supported ? perimap_VERTEX_SUPPORTED : perimap_VERTEX_UNCERTAIN;
    const auto column = static_cast<Eigen::Index>(v);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<Eigen::Index>(3 * v + axis);
      for (std::size_t j = 0; j < B; ++j) {
        coefficients_[(axis * B + j) * V + v] =
            static_cast<float>(mesh.coefficients_W_mm(row, static_cast<Eigen::Index>(j)));
      }
    }
    for (std::size_t e = 0; e < 6; ++e) {
      covariances_[e * V + v] = static_cast<float>(mesh.covariances_W_mm2(static_cast<Eigen::Index>(e), column));
    }
  }
  for (const auto& triangle : mesh.triangles) triangles_.insert(triangles_.end(), triangle.begin(), triangle.end());
  point_to(wire_.vertex_states, vertex_states_);
  point_to(wire_.coefficients_W_mm, coefficients_);
  point_to(wire_.covariances_W_mm2, covariances_);
  point_to(wire_.triangles, triangles_);
}

void WireMesh::say_none(std::uint8_t reason) {
  wire_.state = perimap_MESH_NONE;
  wire_.reason = reason;
  wire_.phase_law = 0;
  wire_.cardiac_harmonics = wire_.respiratory_harmonics = 0;
  wire_.features = wire_.features_contradicting = 0;
  wire_.leave_one_out_rms_mm = wire_.leave_one_out_nees = 0.0;
  wire_.vertex_states = {};
  wire_.coefficients_W_mm = {};
  wire_.covariances_W_mm2 = {};
  wire_.triangles = {};
}

}  // namespace perimap
