// Features on that side of the simulated heart which faces the scope, without pictures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/surface/surface_evidence.hpp"
#include "drivers/standins/truth/heart_mesh.hpp"

namespace perimap::test {

struct SeenSettings {
  std::size_t features = 100;
  double patch_mm = 45.0;   // radius of what is seen
  double aside_mm = 0.0;    // features lie this far beside the patch's middle and beyond, on one side
  double feature_mm = 0.1;  // a feature's deviation across the view; twice as much along it
  double common_mm = 0.0;   // RMS of an error that all features have in common
};

// Rows x, y, z; columns of the basis; mm.
using PlaceHarmonics = Eigen::Matrix3Xd;

struct HeartPatch {
  Vector3d target_W, camera_W;
  std::vector<std::size_t> triangles;  // first index of each that is seen
};

// From the heart to the scope, unit.
[[nodiscard]] Vector3d towards_scope();

[[nodiscard]] PlaceHarmonics harmonics_of(const HeartMesh& heart, std::uint32_t vertex);

[[nodiscard]] HeartPatch patch_of(const HeartMesh& heart, const SeenSettings& settings);

// True ones, drawn on the patch, none near to another.
[[nodiscard]] std::vector<PlaceHarmonics> features_of(const HeartMesh& heart, const HeartPatch& patch,
                                                      const SeenSettings& settings, std::uint64_t seed);

// What is known of one: with errors as it claims.
[[nodiscard]] SurfaceEvidence evidence_of(const PlaceHarmonics& truth, std::uint32_t id, const SeenSettings& settings,
                                          std::uint64_t seed, const Vector3d& common_W);

}  // namespace perimap::test
