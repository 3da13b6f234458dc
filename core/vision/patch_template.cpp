#include "core/vision/patch_template.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/vision/patch_kernels.hpp"
#include "core/vision/reduced_window.hpp"

namespace perimap {
namespace {

using Vector6 = Eigen::Matrix<double, PatchTemplate::kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, PatchTemplate::kParameters, PatchTemplate::kParameters>;

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

// The quadratic B-spline in the middle of a pixel: 1/8, 3/4, 1/8 along rows and columns.
std::int16_t smoothed(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below) noexcept {
  const auto across = [](const std::uint8_t* p) { return p[-1] + 6 * p[0] + p[1]; };
  const double grey = (across(above) + 6 * across(here) + across(below)) / 64.0 - PatchTemplate::kGreyOrigin;
  return static_cast<std::int16_t>(std::lround(PatchTemplate::kGreyScale * grey));
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
  level.offset_x = u - column;
  level.offset_y = v - row;
  for (int y = 0; y < side; ++y) {
    const std::uint8_t* above = image.row(row - half + y - 1) + column - half;
    const std::uint8_t* here = image.row(row - half + y) + column - half;
    const std::uint8_t* below = image.row(row - half + y + 1) + column - half;
    const std::size_t start = static_cast<std::size_t>(y) * static_cast<std::size_t>(side);
    for (int x = 0; x < side; ++x) {  // what follows is 0 from the start
      const std::size_t i = start + static_cast<std::size_t>(x);
      level.value[i] = smoothed(above + x, here + x, below + x);
      level.gradient_x[i] = static_cast<std::int16_t>(above[x + 1] - above[x - 1] + 2 * (here[x + 1] - here[x - 1]) +
                                                      below[x + 1] - below[x - 1]);
      level.gradient_y[i] = static_cast<std::int16_t>(below[x - 1] - above[x - 1] + 2 * (below[x] - above[x]) +
                                                      below[x + 1] - above[x + 1]);
    }
  }
  return true;
}

void form_moments(PatchTemplate& patch) noexcept {
  const PatchTemplate::Level& level = patch.levels[0];
  for (int y = 0; y < level.side; ++y) {
    for (int x = 0; x < level.side; ++x) {
      const auto i = static_cast<std::size_t>(y * level.side + x);
      const auto moment = [](int gradient, int distance) {
        const double exact = static_cast<double>(gradient) * distance / PatchTemplate::kMomentDivisor;
        return static_cast<std::int16_t>(std::lround(exact));
      };
      const int column = x - level.half(), row = y - level.half();
      patch.gradient_moments[0][i] = moment(level.gradient_x[i], column);
      patch.gradient_moments[1][i] = moment(level.gradient_x[i], row);
      patch.gradient_moments[2][i] = moment(level.gradient_y[i], column);
      patch.gradient_moments[3][i] = moment(level.gradient_y[i], row);
    }
  }
}

// The projected Hessian, and the level's sums that projection needs. Level 0 takes its moments as they are rounded, so
// that the projection is exact.
Matrix6 project(PatchTemplate& patch, int l) noexcept {
  PatchTemplate::Level& level = patch.levels[static_cast<std::size_t>(l)];
  const int n = level.side * level.side;
  double sum = 0, sum_squares = 0;
  Vector6 sd_sum = Vector6::Zero(), sd_grey = Vector6::Zero();
  Matrix6 H = Matrix6::Zero();
  constexpr double kMoment = PatchTemplate::kMomentDivisor / PatchTemplate::kGradientScale;
  for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
    const double t = static_cast<double>(level.value[i]) / PatchTemplate::kGreyScale;
    const double gx = level.gradient_x[i] / PatchTemplate::kGradientScale;
    const double gy = level.gradient_y[i] / PatchTemplate::kGradientScale;
    Vector6 sd = Vector6::Zero();
    sd.head<2>() << gx, gy;
    if (l == 0) {
      const auto& moments = patch.gradient_moments;
      sd.tail<4>() << kMoment * moments[0][i] - gx * level.offset_x, kMoment * moments[1][i] - gx * level.offset_y,
          kMoment * moments[2][i] - gy * level.offset_x, kMoment * moments[3][i] - gy * level.offset_y;
    }
    sum += t;
    sum_squares += t * t;
    sd_sum += sd;
    sd_grey += t * sd;
    H.noalias() += sd * sd.transpose();
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

// Of the window that was cut around px.
double saturated_share(const GreyImage& image, const Vector2d& px, int side, int saturated_grey) noexcept {
  const auto left = std::lround(px.x()) - side / 2, top = std::lround(px.y()) - side / 2;
  long count = 0;
  for (int y = 0; y < side; ++y) {
    const std::uint8_t* const row = image.row(static_cast<int>(top) + y) + left;
    count += std::count_if(row, row + side, [=](std::uint8_t grey) { return grey >= saturated_grey; });
  }
  return static_cast<double>(count) / (side * side);
}

}  // namespace

TemplateVerdict make_patch_template(const GreyImage& image, const Vector2d& px, const TemplateSettings& settings,
                                    const PatchKernels& kernels, PatchTemplate& out) noexcept {
  out = PatchTemplate{};
  for (int l = 0; l < PatchTemplate::kLevels; ++l) {
    PatchTemplate::Level& level = out.levels[static_cast<std::size_t>(l)];
    const int side = PatchTemplate::kSide[static_cast<std::size_t>(l)];
    if (l == 0) {
      if (image.data == nullptr || !cut_window(image, px.x(), px.y(), side, level)) {
        return TemplateVerdict::kTooNearBorder;
      }
      if (saturated_share(image, px, side, settings.saturated_grey) > settings.max_saturated_share) {
        return TemplateVerdict::kSaturated;
      }
      form_moments(out);
    } else {
      const Vector2d centre = to_level(px, l);
      const int half = side / 2;
      const ReducedWindow window(image, l, centre, half + 2, kernels);
      const Vector2d inside = centre - window.origin();
      if (!cut_window(window.image(), inside.x(), inside.y(), side, level)) continue;
    }
    const Matrix6 H = project(out, l);
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
