#include "core/vision/patch_template.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>

namespace perimap {
namespace {

using Vector6 = Eigen::Matrix<double, PatchTemplate::kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, PatchTemplate::kParameters, PatchTemplate::kParameters>;

double smaller_eigenvalue(const Matrix2d& H) noexcept {
  const double half_trace = 0.5 * (H(0, 0) + H(1, 1));
  return half_trace - std::hypot(0.5 * (H(0, 0) - H(1, 1)), H(0, 1));
}

// Whether the affine parameters are determined: every pivot of the Hessian, in units in which m moves the rim of the
// window by about a pixel, must be a fair part of the strongest.
bool is_well_conditioned(const Matrix6& H, double half) noexcept {
  Vector6 scale;
  scale << 1, 1, 1 / half, 1 / half, 1 / half, 1 / half;
  const Matrix6 scaled = scale.asDiagonal() * H * scale.asDiagonal();
  const Eigen::LDLT<Matrix6> ldlt(scaled);
  constexpr double kSmallestPivot = 1e-3;
  return ldlt.vectorD().minCoeff() > kSmallestPivot * ldlt.vectorD().maxCoeff();
}

// Fills the level around the whole pixel nearest to the feature. False if it does not fit.
bool cut_window(const GreyImage& image, double u, double v, int side, PatchTemplate::Level& level) noexcept {
  const int half = side / 2;
  const int margin = half + 1;  // the gradients reach one pixel further
  // Written so that a coordinate that is not a number fails too.
  if (!(u >= margin && u <= image.width - 1 - margin && v >= margin && v <= image.height - 1 - margin)) return false;
  const int column = static_cast<int>(std::lround(u));
  const int row = static_cast<int>(std::lround(v));
  level.side = side;
  level.stride = (side + 7) / 8 * 8;
  level.offset_x = u - column;
  level.offset_y = v - row;
  for (int y = 0; y < side; ++y) {
    const std::uint8_t* above = image.row(row - half + y - 1) + column - half;
    const std::uint8_t* here = image.row(row - half + y) + column - half;
    const std::uint8_t* below = image.row(row - half + y + 1) + column - half;
    const std::size_t start = static_cast<std::size_t>(y) * static_cast<std::size_t>(level.stride);
    for (int x = 0; x < side; ++x) {  // the padding is 0 from the start
      const std::size_t i = start + static_cast<std::size_t>(x);
      level.value[i] = static_cast<std::int16_t>(here[x] - PatchTemplate::kGreyOrigin);
      level.gradient_x[i] = static_cast<std::int16_t>(above[x + 1] - above[x - 1] + 2 * (here[x + 1] - here[x - 1]) +
                                                      below[x + 1] - below[x - 1]);
      level.gradient_y[i] = static_cast<std::int16_t>(below[x - 1] - above[x - 1] + 2 * (below[x] - above[x]) +
                                                      below[x + 1] - above[x + 1]);
    }
  }
  return true;
}

// The projected Hessian, and the level's sums that projection needs.
Matrix6 project(PatchTemplate::Level& level) noexcept {
  const int n = level.side * level.side;
  double sum = 0, sum_squares = 0;
  Vector6 sd_sum = Vector6::Zero(), sd_grey = Vector6::Zero();
  Matrix6 H = Matrix6::Zero();
  for (int y = 0; y < level.side; ++y) {
    for (int x = 0; x < level.side; ++x) {
      const std::size_t i = static_cast<std::size_t>(y * level.stride + x);
      const double t = level.value[i];
      const double gx = level.gradient_x[i] / PatchTemplate::kGradientScale;
      const double gy = level.gradient_y[i] / PatchTemplate::kGradientScale;
      const double dx = x - level.half() - level.offset_x, dy = y - level.half() - level.offset_y;
      Vector6 sd;
      sd << gx, gy, gx * dx, gx * dy, gy * dx, gy * dy;
      sum += t;
      sum_squares += t * t;
      sd_sum += sd;
      sd_grey += t * sd;
      H.noalias() += sd * sd.transpose();
    }
  }
  level.mean = sum / n;
  level.sum_squares = sum_squares - sum * level.mean;
  const Vector6 sd_mean = sd_sum / n;
  Vector6 sd_on_grey = Vector6::Zero();
  if (level.sum_squares > 0) sd_on_grey = (sd_grey - level.mean * sd_sum) / level.sum_squares;
  H -= n * sd_mean * sd_mean.transpose() + level.sum_squares * sd_on_grey * sd_on_grey.transpose();
  Vector6::Map(level.sd_mean.data()) = sd_mean;
  Vector6::Map(level.sd_on_grey.data()) = sd_on_grey;
  return H;
}

double saturated_share(const PatchTemplate::Level& level, int saturated_grey) noexcept {
  int count = 0;
  for (int y = 0; y < level.side; ++y) {
    for (int x = 0; x < level.side; ++x) {
      const int grey = level.value[static_cast<std::size_t>(y * level.stride + x)] + PatchTemplate::kGreyOrigin;
      count += grey >= saturated_grey ? 1 : 0;
    }
  }
  return static_cast<double>(count) / (level.side * level.side);
}

}  // namespace

TemplateVerdict make_patch_template(const ImagePyramid& pyramid, const Vector2d& px, const TemplateSettings& settings,
                                    PatchTemplate& out) noexcept {
  out = PatchTemplate{};
  for (int l = 0; l < pyramid.levels(); ++l) {
    PatchTemplate::Level& level = out.levels[static_cast<std::size_t>(l)];
    const double scale = 1.0 / (1 << l);
    const int side = PatchTemplate::kSide[static_cast<std::size_t>(l)];
    if (!cut_window(pyramid.level(l), scale * px.x(), scale * px.y(), side, level)) {
      if (l == 0) return TemplateVerdict::kTooNearBorder;
      continue;
    }
    if (l == 0 && saturated_share(level, settings.saturated_grey) > settings.max_saturated_share) {
      return TemplateVerdict::kSaturated;
    }
    const Matrix6 H = project(level);
    const Matrix2d H_t = H.topLeftCorner<2, 2>();
    const double min_texture = l == 0 ? settings.min_texture : settings.min_texture_coarse;
    if (!(smaller_eigenvalue(H_t) > min_texture * level.side * level.side)) {
      if (l == 0) return TemplateVerdict::kTooLittleTexture;
      continue;
    }
    const double determinant = H_t(0, 0) * H_t(1, 1) - H_t(0, 1) * H_t(1, 0);
    level.translation_inverse = {H_t(1, 1) / determinant, -H_t(0, 1) / determinant, -H_t(1, 0) / determinant,
                                 H_t(0, 0) / determinant};
    level.usable = true;
    if (l == 0 && is_well_conditioned(H, level.half())) {
      out.affine_usable = true;
      Matrix6::Map(out.affine_inverse.data()) = H.ldlt().solve(Matrix6::Identity());
    }
  }
  return TemplateVerdict::kGood;
}

}  // namespace perimap
