// The moving surface at one phase of the heart, as points to fit to.
#pragma once

#include "core/registration/model_fit.hpp"
#include "core/surface/surface_mesh.hpp"

namespace perimap {

// Nearer to its edge than this the surface is surer of itself than it should be (docs/evidence/surface.md), mm.
inline constexpr double kSurfaceRim_mm = 5.0;

// The vertices that its triangles have and that lie kSurfaceRim_mm and more from its edge, at that phase and in the
// middle of breathing: a model was made while the breath was held, and how far that moves the organ as a whole is the
// registration's.
[[nodiscard]] SurfacePoints points_at(const SurfaceMesh& mesh, double cardiac_phase_rad);

// About how far the features are apart that a surface of these triangles rests on, mm.
[[nodiscard]] double feature_spacing_mm(const SurfaceMesh& mesh, std::size_t features);

// By the mean square of each feature beside what all others make of it, relative to what it should be (leave one out):
// where they agree better than they claim, the rest of the claim is an error that all have (docs/design/surface.md).
[[nodiscard]] double common_share_of(double leave_one_out_nees) noexcept;

}  // namespace perimap
