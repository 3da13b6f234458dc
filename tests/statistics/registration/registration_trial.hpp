// A surface through features of the simulated heart, and a preoperative model of it that is registered nearly.
#pragma once

#include <cstdint>

#include "core/registration/model_fit.hpp"
#include "drivers/standins/simulator/preoperative.hpp"
#include "drivers/standins/truth/heart_mesh.hpp"
#include "heart_patch.hpp"

namespace perimap::test {

struct TrialSettings {
  std::uint64_t seed = 1;
  SeenSettings seen;
  PreoperativeSettings model;  // its seed and its phase are drawn
};

struct RegistrationTrial {
  SurfacePoints surface;
  ModelErrors errors;  // what follows of the surface; the shape's and the phase's are not set
  PreoperativeModel model;
  RigidEstimate start;
};

// Throws where the features make no surface.
[[nodiscard]] RegistrationTrial registration_trial(const HeartMesh& heart, const TrialSettings& settings);

// The second heart in the first one's place, in the model's frame.
[[nodiscard]] TriangleMesh another_heart(const RegistrationTrial& trial, std::uint64_t seed);
// The model mirrored at a plane through its middle that is drawn, its triangles turned so that they face outwards.
[[nodiscard]] TriangleMesh mirrored(const RegistrationTrial& trial, std::uint64_t seed);

}  // namespace perimap::test
