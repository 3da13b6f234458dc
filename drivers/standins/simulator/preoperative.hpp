// A preoperative model of a simulated heart: what a scan weeks before would have, which is not the truth. Its shape has
// an error that is smooth over the heart, it lies in the scanner's frame I, and the registration that is known of it is
// off.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "drivers/standins/truth/heart_mesh.hpp"

namespace perimap {

struct PreoperativeSettings {
  std::uint64_t seed = 1;
  double phase_rad = 0.0;         // of the heart when it was scanned
  double shape_error_mm = 2.0;    // RMS over the surface, along its normal
  double shape_length_mm = 30.0;  // over which that changes
  double off_mm = 3.0;            // of the registration that is known, about the heart's middle: in a direction drawn
  double off_rad = 0.0523598775598298873;  // 3 degrees, likewise

  // The same vertices at other phases, as the model has it: right where it was scanned at phase_rad.
  std::vector<double> other_phases_rad;
  double motion_shift_rad = 0.0;  // it moves earlier by so much of the phase
  double motion_scale = 1.0;      // and by so many times as much
  double motion_error = 0.0;  // by which share it moves too much or too little, RMS over the surface, likewise smooth
  bool other_motion = false;  // as a second heart does
};

struct PreoperativeModel {
  TriangleMesh mesh_I;
  std::vector<TriangleMesh> others_I;    // at the other phases
  Pose true_X_IW;                        // from the tracker's frame to the scanner's
  Pose start_X_IW;                       // that is known
  Vector3d middle_I = Vector3d::Zero();  // of the heart
};

// A function of its arguments alone. `heart_W`: where it beats, in the tracker's frame.
[[nodiscard]] PreoperativeModel preoperative_model(const HeartMesh& heart_W, const PreoperativeSettings& settings);

// Registrations as `perimap register --output` writes them: the true one, and that from which a refinement starts,
// whose deviations are those that it was drawn with.
[[nodiscard]] std::string true_registration_of(const PreoperativeModel& model);
[[nodiscard]] std::string start_registration_of(const PreoperativeModel& model, const PreoperativeSettings& settings);

}  // namespace perimap
