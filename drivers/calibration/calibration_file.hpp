// Camera calibration files as OpenCV writes them (cv::FileStorage, YAML or JSON): camera_matrix,
// distortion_coefficients, image_width, image_height; distortion_model or fisheye_model tells a fisheye. Other keys are
// ignored. Read by yaml-cpp, because cv::FileStorage crashes on damaged files (OpenCV 4.6: XML that ends in an
// attribute).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"

namespace perimap {

// Accepts distortion_coefficients of 4, 5, 8, 12 or 14 numbers (k1 k2 p1 p2 k3 ...) as long as those after the fifth
// are zero, and matrices with or without OpenCV's type tag. With `distortion_model: equidistant` (or fisheye) they are
// the four of cv::fisheye, and so they are with `fisheye_model: 1`, as OpenCV's own calibration program writes; without
// either key the lens is Brown-Conrady's. A key that is there twice is an error. Errors name the file and the key.
[[nodiscard]] Expected<CameraModel> read_calibration(const std::filesystem::path& file);

// The same from memory; `name` stands in messages.
[[nodiscard]] Expected<CameraModel> parse_calibration(std::string_view text, std::string_view name);

// As YAML; parsing it gives exactly the same numbers.
[[nodiscard]] std::string format_calibration(const CameraModel& camera);

// Likewise, with `more` keys behind it, and a line by which reading notices that something was changed or cut off:
// digits alone would not show it.
[[nodiscard]] std::string sealed_calibration(const CameraModel& camera, std::string_view more = {});

[[nodiscard]] Expected<void> write_calibration(const std::filesystem::path& file, const CameraModel& camera);

}  // namespace perimap
