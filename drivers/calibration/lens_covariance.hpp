// How well a lens is known, in its calibration file beside OpenCV's keys.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/geometry/camera_model.hpp"

namespace perimap {

// Of fx fy cx cy (px), then k1 k2 p1 p2 k3, or k1 k2 k3 k4 of a fisheye and one that is not there; what is held has
// rows of zeros.
using LensCovariance = Eigen::Matrix<double, 9, 9>;

// The lens with its numbers changed by these, in that order.
[[nodiscard]] CameraModel changed_lens(const CameraModel& lens, const Eigen::Matrix<double, 9, 1>& change) noexcept;

// Keys to stand behind those of format_calibration().
[[nodiscard]] std::string format_lens_covariance(const LensCovariance& covariance);

// None: the calibration has none, as those of other programs, or it is no covariance.
[[nodiscard]] std::optional<LensCovariance> parse_lens_covariance(std::string_view text);
[[nodiscard]] std::optional<LensCovariance> read_lens_covariance(const std::filesystem::path& file);

}  // namespace perimap
