// A registration as `perimap register --output` and `perimap refine --output` write it.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string_view>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

struct RegistrationFile {
  Pose X_IW;  // from the tracker's frame to the image's, mm
  // Of (rotation vector, translation) in I about `middle_I`, rad and mm; none where three landmarks told no error.
  std::optional<Eigen::Matrix<double, 6, 6>> covariance;
  Vector3d middle_I = Vector3d::Zero();
};

// Errors name the file and the key. A quaternion is normalised; a covariance is symmetric, with positive variances.
[[nodiscard]] Expected<RegistrationFile> read_registration(const std::filesystem::path& file);

// The same from memory; `name` stands in messages.
[[nodiscard]] Expected<RegistrationFile> parse_registration(std::string_view text, std::string_view name);

}  // namespace perimap
