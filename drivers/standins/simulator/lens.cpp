#include "drivers/standins/simulator/lens.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>

namespace perimap {
namespace {

// Distorted normalised coordinates and, where asked for, their Jacobian.
Vector2d distort(const ScopeLens& lens, const Vector2d& n, Matrix2d* jacobian) noexcept {
  const double x = n.x();
  const double y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  if (jacobian != nullptr) {
    const double slope = 2.0 * (lens.k1 + r2 * (2.0 * lens.k2 + 3.0 * r2 * lens.k3));  // d radial / d(r2) * 2
    const double mixed = x * y * slope + 2.0 * lens.p1 * x + 2.0 * lens.p2 * y;
    *jacobian << radial + x * x * slope + 2.0 * lens.p1 * y + 6.0 * lens.p2 * x, mixed,  //
        mixed, radial + y * y * slope + 6.0 * lens.p1 * y + 2.0 * lens.p2 * x;
  }
  return {x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x),
          y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y};
}

}  // namespace

Vector2d ScopeLens::project(const Vector3d& p_C) const noexcept {
  const Vector2d d = distort(*this, p_C.head<2>() / p_C.z(), nullptr);
  return {fx * d.x() + cx, fy * d.y() + cy};
}

Vector3d ScopeLens::ray(const Vector2d& pixel) const noexcept {
  const Vector2d distorted((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  Vector2d n = distorted;
  for (int iteration = 0; iteration < 8; ++iteration) {
    Matrix2d jacobian;
    const Vector2d error = distort(*this, n, &jacobian) - distorted;
    n -= jacobian.inverse() * error;
  }
  return {n.x(), n.y(), 1.0};
}

std::string ScopeLens::opencv_yaml() const {
  return fmt::format(
      "%YAML:1.0\n---\n"
      "image_width: {}\nimage_height: {}\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ {:.17g}, 0., {:.17g}, 0., {:.17g}, {:.17g}, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
      "   data: [ {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g} ]\n",
      width, height, fx, cx, fy, cy, k1, k2, p1, p2, k3);
}

ScopeLens scope_lens(int width_px, int height_px) noexcept {
  const double focal = 1.25 * std::max(width_px, height_px);
  ScopeLens lens;
  lens.width = width_px;
  lens.height = height_px;
  lens.fx = focal;
  lens.fy = 1.002 * focal;
  lens.cx = 0.5 * (width_px - 1) + 0.012 * width_px;
  lens.cy = 0.5 * (height_px - 1) - 0.009 * height_px;
  lens.k1 = -0.12;
  lens.k2 = 0.05;
  lens.p1 = 0.0006;
  lens.p2 = -0.0004;
  return lens;
}

}  // namespace perimap
