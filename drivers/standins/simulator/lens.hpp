// The simulated scope's optics: pinhole with Brown-Conrady distortion, in OpenCV's convention and order.
#pragma once

#include <string>

#include "core/geometry/pose.hpp"

namespace perimap {

// Pixel centres lie at integer coordinates.
struct ScopeLens {
  int width = 0;                                  // px
  int height = 0;                                 // px
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  // px
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;

  // Pixel of a point in front of the camera (C, z > 0).
  [[nodiscard]] Vector2d project(const Vector3d& p_C) const noexcept;

  // (x, y, 1): the ray of a pixel. Newton's method on the distortion, to better than 1e-9 px for mild distortion.
  [[nodiscard]] Vector3d ray(const Vector2d& pixel) const noexcept;

  // The YAML that OpenCV's cv::FileStorage writes: image_width, image_height, camera_matrix, distortion_coefficients.
  [[nodiscard]] std::string opencv_yaml() const;
};

// A rigid scope's view, 44 degrees wide, for an image of this size.
[[nodiscard]] ScopeLens scope_lens(int width_px, int height_px) noexcept;

}  // namespace perimap
