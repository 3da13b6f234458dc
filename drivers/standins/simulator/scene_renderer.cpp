#include "drivers/standins/simulator/scene_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/truth/triangle_rays.hpp"

namespace perimap {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kSubsamples = 2;  // a side of each pixel, for what covers it; shaded once where one triangle does
constexpr int kTile = 16;       // subsamples a side
constexpr std::int32_t kNone = -1;
constexpr double kNearest_mm = 5.0;  // what comes nearer to the lens than this is not drawn

// The light stands beside the lens, as in an endoscope's ring of fibres.
const Vector3f kLight_C(-3.0F, -5.0F, 0.0F);  // mm

using Int4 __attribute__((vector_size(16))) = std::int32_t;

template <class Vector>
Vector load(const typename std::remove_reference_t<decltype(std::declval<Vector>()[0])>* from) noexcept {
  Vector v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

template <class Vector, class Value>
void store(Value* to, Vector v) noexcept {
  std::memcpy(to, &v, sizeof v);
}

RenderWorkspace::Plane4 plane(const Eigen::Matrix<float, 4, 3>& rows) noexcept {
  const auto column = [&](int c) { return Float4{rows(0, c), rows(1, c), rows(2, c), rows(3, c)}; };
  return {column(0), column(1), column(2)};
}

}  // namespace

SceneRenderer::SceneRenderer(const ScopeLens& lens, std::span<const std::uint32_t> triangles,
                             const TissueTexture& texture, const PictureLook& look, const FieldStop& stop)
    : lens_(lens),
      triangles_(triangles),
      texture_(texture),
      look_(look),
      stride_((kSubsamples * lens.width + 3) / 4 * 4) {
  const std::size_t subsamples = static_cast<std::size_t>(stride_) * kSubsamples * lens.height;
  ray_x_.resize(subsamples, 0.0F);
  ray_y_.resize(subsamples, 0.0F);
  for (int row = 0; row < kSubsamples * lens.height; ++row) {
    for (int column = 0; column < kSubsamples * lens.width; ++column) {
      const auto place = [](int subsample) { return (subsample + 0.5) / kSubsamples - 0.5; };
      const Vector3d ray = lens.ray({place(column), place(row)});
      const std::size_t index = static_cast<std::size_t>(row) * stride_ + column;
      ray_x_[index] = static_cast<float>(ray.x());
      ray_y_[index] = static_cast<float>(ray.y());
    }
  }
  vignetting_.resize(static_cast<std::size_t>(lens.width) * lens.height);
  for (int row = 0; row < lens.height; ++row) {
    for (int column = 0; column < lens.width; ++column) {
      const double cosine = 1.0 / lens.ray({column, row}).norm();
      vignetting_[static_cast<std::size_t>(row) * lens.width + column] =
          static_cast<float>(std::pow(cosine, look_.vignetting) * stop.passed(Vector2d(column, row)));
    }
  }
}

void SceneRenderer::project(const Pose& X_WC, std::span<const Vector3d> vertices_W, RenderWorkspace& workspace) const {
  const Pose X_CW = X_WC.inverse();
  const std::size_t count = vertices_W.size();
  workspace.vertices_C.resize(count);
  workspace.pixels.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d p_C = X_CW * vertices_W[i];
    workspace.vertices_C[i] = p_C;
    if (p_C.z() >= kNearest_mm) workspace.pixels[i] = lens_.project(p_C).cast<float>();
  }

  // Normals: mean of the triangles around, weighted by area. Texture level: what one pixel's width spans on the chart,
  // between the mean and the larger of its two directions, so that a slanted surface neither shimmers nor blurs.
  workspace.normals_C.assign(count, Vector3f::Zero());
  workspace.level.assign(count, 0.0F);
  workspace.level_count.assign(count, 0.0F);
  for (std::size_t t = 0; t + 2 < triangles_.size(); t += 3) {
    const std::uint32_t a = triangles_[t];
    const std::uint32_t b = triangles_[t + 1];
    const std::uint32_t c = triangles_[t + 2];
    const Vector3d& p_a = workspace.vertices_C[a];
    const Vector3d& p_b = workspace.vertices_C[b];
    const Vector3d& p_c = workspace.vertices_C[c];
    const Vector3f normal = (p_b - p_a).cross(p_c - p_a).cast<float>();
    for (const std::uint32_t vertex : {a, b, c}) workspace.normals_C[vertex] += normal;

    if (std::min({p_a.z(), p_b.z(), p_c.z()}) < kNearest_mm) continue;
    Eigen::Matrix2f on_image;
    on_image << workspace.pixels[b] - workspace.pixels[a], workspace.pixels[c] - workspace.pixels[a];
    const float image_area = std::abs(on_image.determinant());
    if (image_area < 1e-2F) continue;
    Eigen::Matrix2f on_chart;
    on_chart << texture_.uv(b) - texture_.uv(a), texture_.uv(c) - texture_.uv(a);
    const Eigen::Matrix2f texels = on_chart * on_image.inverse();
    const float mean = std::sqrt(std::max(1e-12F, std::abs(texels.determinant())));
    const float level = 0.5F * std::log2(mean * texels.norm());
    for (const std::uint32_t vertex : {a, b, c}) {
      workspace.level[vertex] += level;
      workspace.level_count[vertex] += 1.0F;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    workspace.normals_C[i].normalize();
    if (workspace.level_count[i] > 0.0F) workspace.level[i] /= workspace.level_count[i];
  }
}

void SceneRenderer::draw(std::size_t t, RenderWorkspace& workspace, const Bounds& bounds) const {
  const std::uint32_t* corners = triangles_.data() + 3 * t;
  const TriangleRays rays(workspace.vertices_C[corners[0]], workspace.vertices_C[corners[1]],
                          workspace.vertices_C[corners[2]]);
  if (!rays.valid) return;

  Eigen::Matrix<double, 4, 3> weights;
  weights << rays.inverse, rays.inverse.colwise().sum();
  Eigen::Matrix<double, 4, 3> chart = Eigen::Matrix<double, 4, 3>::Zero();
  Eigen::Matrix<double, 4, 3> normal = Eigen::Matrix<double, 4, 3>::Zero();
  for (int i = 0; i < 3; ++i) {
    const Vector2f& uv = texture_.uv(corners[i]);
    const Vector3f& n = workspace.normals_C[corners[i]];
    chart += Eigen::Vector4d(uv.x(), uv.y(), workspace.level[corners[i]], 0.0) * rays.inverse.row(i);
    normal += Eigen::Vector4d(n.x(), n.y(), n.z(), 0.0) * rays.inverse.row(i);
  }
  RenderWorkspace::Triangle& triangle = workspace.triangles[t];
  triangle = {plane(weights.cast<float>()), plane(chart.cast<float>()), plane(normal.cast<float>())};

  // Four subsamples at a time. The slack keeps rays on a shared edge from falling between both triangles.
  const RenderWorkspace::Plane4 w = triangle.weights;
  const auto id = static_cast<std::int32_t>(t);
  const Int4 ids = {id, id, id, id};
  const float slack = -1e-4F * static_cast<float>(1.0 / workspace.vertices_C[corners[0]].z());
  for (int row = bounds.top; row <= bounds.bottom; ++row) {
    const std::size_t start = static_cast<std::size_t>(row) * stride_;
    for (int column = bounds.left / 4 * 4; column <= bounds.right; column += 4) {
      const std::size_t at = start + column;
      const Float4 x = load<Float4>(&ray_x_[at]);
      const Float4 y = load<Float4>(&ray_y_[at]);
      const Float4 w_0 = w.x[0] * x + w.y[0] * y + w.one[0];
      const Float4 w_1 = w.x[1] * x + w.y[1] * y + w.one[1];
      const Float4 w_2 = w.x[2] * x + w.y[2] * y + w.one[2];
      const Float4 depth = w.x[3] * x + w.y[3] * y + w.one[3];
      const Float4 depth_before = load<Float4>(&workspace.inverse_depth[at]);
      const Int4 seen = (w_0 >= slack) & (w_1 >= slack) & (w_2 >= slack) & (depth > depth_before);
      store(&workspace.inverse_depth[at], seen ? depth : depth_before);
      store(&workspace.triangle_seen[at], seen ? ids : load<Int4>(&workspace.triangle_seen[at]));
    }
  }
}

std::optional<SceneRenderer::Bounds> SceneRenderer::bounds(std::size_t t, const RenderWorkspace& workspace) const {
  Vector2f low = Vector2f::Constant(1e9F);
  Vector2f high = Vector2f::Constant(-1e9F);
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t corner = triangles_[3 * t + i];
    if (workspace.vertices_C[corner].z() < kNearest_mm) return std::nullopt;
    low = low.cwiseMin(workspace.pixels[corner]);
    high = high.cwiseMax(workspace.pixels[corner]);
  }
  // Distortion bends an edge by about 0.1 % of its length; the margin covers that.
  const float margin = 0.05F + 0.01F * (high - low).maxCoeff();
  const auto subsample = [](float pixel) { return (pixel + 0.5F) * kSubsamples - 0.5F; };
  const auto limit = [](float value, int last) { return std::clamp(value, -1.0F, static_cast<float>(last + 1)); };
  const int last_column = kSubsamples * lens_.width - 1;
  const int last_row = kSubsamples * lens_.height - 1;
  Bounds b{};
  b.left = std::max(0, static_cast<int>(std::ceil(limit(subsample(low.x() - margin), last_column))));
  b.right = std::min(last_column, static_cast<int>(std::floor(limit(subsample(high.x() + margin), last_column))));
  b.top = std::max(0, static_cast<int>(std::ceil(limit(subsample(low.y() - margin), last_row))));
  b.bottom = std::min(last_row, static_cast<int>(std::floor(limit(subsample(high.y() + margin), last_row))));
  if (b.left > b.right || b.top > b.bottom) return std::nullopt;
  return b;
}

void SceneRenderer::find_visible(RenderWorkspace& workspace) const {
  workspace.inverse_depth.assign(ray_x_.size(), 0.0F);
  workspace.triangle_seen.assign(ray_x_.size(), kNone);
  workspace.triangles.resize(triangles_.size() / 3);
  workspace.inner_sides.clear();
  for (std::size_t t = 0; t < workspace.triangles.size(); ++t) {
    const std::optional<Bounds> place = bounds(t, workspace);
    if (!place) continue;
    const Vector3d& a = workspace.vertices_C[triangles_[3 * t]];
    const Vector3d& b = workspace.vertices_C[triangles_[3 * t + 1]];
    const Vector3d& c = workspace.vertices_C[triangles_[3 * t + 2]];
    if ((b - a).cross(c - a).dot(a) > 0.0) {
      workspace.inner_sides.push_back(static_cast<std::uint32_t>(t));
    } else {
      draw(t, workspace, *place);
    }
  }

  // The inner side shows only through the surface's openings. What lies behind all that is drawn already in its tiles
  // of the image needs no second look.
  const int columns = kSubsamples * lens_.width;
  const int rows = kSubsamples * lens_.height;
  const int tile_columns = (columns + kTile - 1) / kTile;
  const int tile_rows = (rows + kTile - 1) / kTile;
  workspace.farthest.assign(static_cast<std::size_t>(tile_columns) * tile_rows, std::numeric_limits<float>::infinity());
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      float& farthest = workspace.farthest[static_cast<std::size_t>(row / kTile) * tile_columns + column / kTile];
      farthest = std::min(farthest, workspace.inverse_depth[static_cast<std::size_t>(row) * stride_ + column]);
    }
  }
  for (const std::uint32_t t : workspace.inner_sides) {
    const std::optional<Bounds> place = bounds(t, workspace);
    double nearest = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      nearest = std::max(nearest, 1.0 / workspace.vertices_C[triangles_[3 * std::size_t{t} + i]].z());
    }
    bool hidden = true;
    for (int row = place->top / kTile; row <= place->bottom / kTile; ++row) {
      for (int column = place->left / kTile; column <= place->right / kTile; ++column) {
        hidden = hidden && nearest < workspace.farthest[static_cast<std::size_t>(row) * tile_columns + column];
      }
    }
    if (!hidden) draw(t, workspace, *place);
  }
}

float SceneRenderer::light_at(const Shot& shot, float x, float y,
                              const RenderWorkspace::Triangle& triangle) const noexcept {
  const float depth = 1.0F / triangle.weights.at(x, y)[3];
  const Float4 chart = triangle.chart.at(x, y) * depth;
  const Float4 tissue = texture_.at(chart[0], chart[1], chart[2]);
  const Float4 n = triangle.normal_C.at(x, y) * depth;

  const Vector3f p_C(x * depth, y * depth, depth);
  const Vector3f to_eye = -p_C / p_C.norm();
  Vector3f to_light = kLight_C - p_C;
  const float distance2 = to_light.squaredNorm();
  to_light /= std::sqrt(distance2);
  Vector3f normal(n[0], n[1], n[2]);
  normal.normalize();
  // A surface seen from its inner side is lit there.
  if (normal.dot(to_eye) < 0.0F) normal = -normal;
  const auto with_bumps = [&](const Float4& sample) -> Vector3f {
    return (normal + shot.R_CW * Vector3f(sample[1], sample[2], sample[3])).normalized();
  };
  const Vector3f bumpy = with_bumps(tissue);

  const float falloff = shot.subject_distance2 / distance2;
  const float diffuse =
      look_.even_light * std::max(0.0F, normal.dot(to_light)) + look_.bumpy_light * std::max(0.0F, bumpy.dot(to_light));
  float light = tissue[0] * (0.04F + diffuse * falloff);
  // Two lobes: the wet film and the tissue below it.
  const Vector3f wet =
      look_.film_flows
          ? with_bumps(texture_.at(chart[0] + shot.film_texels.x(), chart[1] + shot.film_texels.y(), chart[2]))
          : bumpy;
  const float off_mirror = 1.0F - wet.dot((to_eye + to_light).normalized());
  if (off_mirror < look_.off_mirror_most)
    light += falloff * (look_.film.strength * std::exp(-look_.film.sharpness * off_mirror) +
                        look_.tissue_below.strength * std::exp(-look_.tissue_below.sharpness * off_mirror));
  return light;
}

void SceneRenderer::shade(const Shot& shot, RenderWorkspace& workspace) const {
  // The pericardial cavity behind the heart: dark and without detail.
  const auto cavity = [](float y) { return 0.075F + 0.03F * y; };
  workspace.radiance.resize(static_cast<std::size_t>(lens_.width) * lens_.height);
  for (int row = 0; row < lens_.height; ++row) {
    for (int column = 0; column < lens_.width; ++column) {
      const std::size_t first = static_cast<std::size_t>(kSubsamples * row) * stride_ + kSubsamples * column;
      const std::size_t at[4] = {first, first + 1, first + stride_, first + stride_ + 1};
      const std::int32_t* seen = workspace.triangle_seen.data();
      float light = 0.0F;
      if (seen[at[0]] == seen[at[1]] && seen[at[0]] == seen[at[2]] && seen[at[0]] == seen[at[3]]) {
        // One triangle fills the pixel: its middle stands for all of it.
        const float x = 0.25F * (ray_x_[at[0]] + ray_x_[at[1]] + ray_x_[at[2]] + ray_x_[at[3]]);
        const float y = 0.25F * (ray_y_[at[0]] + ray_y_[at[1]] + ray_y_[at[2]] + ray_y_[at[3]]);
        light = seen[at[0]] == kNone ? cavity(y)
                                     : light_at(shot, x, y, workspace.triangles[static_cast<std::size_t>(seen[at[0]])]);
      } else {
        for (const std::size_t i : at) {
          light += 0.25F * (seen[i] == kNone ? cavity(ray_y_[i])
                                             : light_at(shot, ray_x_[i], ray_y_[i],
                                                        workspace.triangles[static_cast<std::size_t>(seen[i])]));
        }
      }
      workspace.radiance[static_cast<std::size_t>(row) * lens_.width + column] = look_.white_grey * light;
    }
  }
}

void SceneRenderer::expose(const FrameLight& frame, std::uint64_t noise_seed, RenderWorkspace& workspace,
                           std::span<std::uint8_t> image) const {
  const int width = lens_.width;
  const int height = lens_.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  const CounterNoise noise(noise_seed, 0);
  const auto exposure =
      static_cast<float>((1.0 + look_.exposure_deviation * noise.normal(pixels)) * static_cast<double>(frame.gain));

  const float side = look_.blur_side;
  workspace.blurred.resize(pixels);
  for (int row = 0; row < height; ++row) {
    const float* in = workspace.radiance.data() + static_cast<std::size_t>(row) * width;
    float* out = workspace.blurred.data() + static_cast<std::size_t>(row) * width;
    for (int column = 0; column < width; ++column) {
      out[column] = (1.0F - 2.0F * side) * in[column] +
                    side * (in[std::max(0, column - 1)] + in[std::min(width - 1, column + 1)]);
    }
  }
  for (int row = 0; row < height; ++row) {
    const float* middle = workspace.blurred.data() + static_cast<std::size_t>(row) * width;
    const float* above = row > 0 ? middle - width : middle;
    const float* below = row + 1 < height ? middle + width : middle;
    for (int column = 0; column < width; ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * width + column;
      const float level =
          exposure * vignetting_[i] * ((1.0F - 2.0F * side) * middle[column] + side * (above[column] + below[column])) +
          frame.veil;
      // Four 16-bit uniform numbers sum to nearly a normal one.
      const std::uint64_t bits = noise.bits(i);
      const auto sum =
          static_cast<float>((bits & 0xffffU) + ((bits >> 16) & 0xffffU) + ((bits >> 32) & 0xffffU) + (bits >> 48));
      constexpr float kStandardDeviation = 37837.2F;  // of the sum: sqrt(4 (65536^2 - 1) / 12)
      const float normal = (sum - 4.0F * 32767.5F) / kStandardDeviation;
      const float clipped = std::min(level, 255.0F);
      const float deviation = std::sqrt(look_.read_variance + clipped / look_.shot_levels);
      image[i] = static_cast<std::uint8_t>(std::clamp(clipped + deviation * normal + 0.5F, 0.0F, 255.0F));
    }
  }
}

void SceneRenderer::light(const Pose& X_WC, std::span<const Vector3d> vertices_W, double subject_distance_mm,
                          const FrameLight& frame, RenderWorkspace& workspace) const {
  project(X_WC, vertices_W, workspace);
  find_visible(workspace);
  shade({X_WC.R.transpose().cast<float>(), static_cast<float>(subject_distance_mm * subject_distance_mm),
         frame.film * static_cast<float>(texture_.size())},
        workspace);
}

}  // namespace perimap
