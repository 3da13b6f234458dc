// A model's landmarks with where each was touched.
#pragma once

#include <string>
#include <vector>

#include "core/calibration/landmark_registration.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/touched_points.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {

// What is read: `touched`, or a recording of the touches.
struct LandmarkSource {
  std::string model;  // the landmarks in the image's frame: name,x,y,z
  LengthUnit unit = LengthUnit::kMetre;
  std::string touched;  // the same in the tracker's frame, in the same unit
  std::string recording;
  std::string tool;  // of the recording, whose tip touches
  std::string tip;   // the file of that tip
  TouchRule touch;
};

// In the order of `touched`, or of the model. Errors name the file and the landmark, or say when touches were found.
[[nodiscard]] SetupExpected<std::vector<Landmark>> read_landmarks(const LandmarkSource& source);

}  // namespace perimap
