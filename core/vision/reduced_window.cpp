#include "core/vision/reduced_window.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {

ReducedWindow::ReducedWindow(const GreyImage& frame, int level, const Vector2d& centre, double reach,
                             const PatchKernels& kernels) noexcept {
  const double within = std::min<double>(reach, kMaxReach);
  const int columns = frame.width >> level, rows = frame.height >> level;
  // Clamped as doubles: what is far outside need not fit an int.
  const auto first = [within](double at) { return std::max(0.0, std::floor(at - within)); };
  const auto end = [within](double at, int count) { return std::min<double>(count, std::ceil(at + within) + 1.0); };
  const double left = first(centre.x()), top = first(centre.y());
  const double right = end(centre.x(), columns), bottom = end(centre.y(), rows);
  if (!(left < right && top < bottom)) return;
  width_ = std::min(static_cast<int>(right - left), kMaxSide);
  height_ = std::min(static_cast<int>(bottom - top), kMaxSide);
  origin_ = {left, top};
  kernels.reduce(frame, level, static_cast<int>(left), static_cast<int>(top), width_, height_, pixels_);
}

}  // namespace perimap
