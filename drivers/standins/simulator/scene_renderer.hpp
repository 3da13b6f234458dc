// Renders what a lit scope sees of the heart: an 8-bit grey image.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"
#include "drivers/standins/simulator/field_stop.hpp"
#include "drivers/standins/simulator/lens.hpp"
#include "drivers/standins/simulator/picture_look.hpp"
#include "drivers/standins/simulator/tissue_texture.hpp"

namespace perimap {

// One thread's scratch memory, reused from frame to frame.
struct RenderWorkspace {
  // A quantity that is linear on the triangle, divided by depth, is linear in the ray: x * ray.x + y * ray.y + one.
  struct Plane4 {
    Float4 x, y, one;
    [[nodiscard]] Float4 at(float ray_x, float ray_y) const noexcept { return x * ray_x + y * ray_y + one; }
  };
  struct Triangle {
    Plane4 weights;   // lambda_0 / z, lambda_1 / z, lambda_2 / z, 1 / z
    Plane4 chart;     // u / z, v / z, texture level / z, unused
    Plane4 normal_C;  // n / z, unused
  };
  std::vector<Vector3d> vertices_C;
  std::vector<Eigen::Vector3f> normals_C;
  std::vector<Eigen::Vector2f> pixels;
  std::vector<float> level;  // texture level per vertex
  std::vector<float> level_count;
  std::vector<Triangle> triangles;
  std::vector<float> inverse_depth;         // per subsample, 1/mm
  std::vector<std::int32_t> triangle_seen;  // per subsample, -1 where the heart is not
  std::vector<std::uint32_t> inner_sides;   // triangles that turn their inner side to the camera
  std::vector<float> farthest;              // per tile of subsamples: the least inverse depth
  std::vector<float> radiance;              // per pixel, grey levels
  std::vector<float> blurred;               // per pixel, after the rows' pass
  std::vector<float> exposure;              // per pixel, radiance summed over a long exposure
};

// Rays are exact: every subsample carries the undistorted ray of its place in the distorted image and is tested against
// each triangle in three dimensions (triangle_rays.hpp), so there is no residual of the distortion beyond that of
// ScopeLens::ray. Light and camera move together: diffuse with fall-off, two highlight lobes, vignetting; then the
// lens's blur, shot and read noise, 8 bits. How much of each is the look's.
class SceneRenderer {
 public:
  // `triangles` and `texture` belong to one mesh and outlive the renderer; the texture is the look's.
  SceneRenderer(const ScopeLens& lens, std::span<const std::uint32_t> triangles, const TissueTexture& texture,
                const PictureLook& look, const FieldStop& stop = {});

  // The two halves of a frame: the light that falls on the sensor into workspace.radiance, and the image made of it.
  // Between them the radiance may be changed, or averaged over the exposure.
  // `vertices_W`: the mesh at the frame's instant. `subject_distance_mm`: where exposure is right. `noise_seed`: one
  // value per frame. `image`: width * height places, row by row. Functions of their arguments alone.
  void light(const Pose& X_WC, std::span<const Vector3d> vertices_W, double subject_distance_mm,
             const FrameLight& frame, RenderWorkspace& workspace) const;
  void expose(const FrameLight& frame, std::uint64_t noise_seed, RenderWorkspace& workspace,
              std::span<std::uint8_t> image) const;

 private:
  void project(const Pose& X_WC, std::span<const Vector3d> vertices_W, RenderWorkspace& workspace) const;
  // Subsamples that a triangle may cover, ends included.
  struct Bounds {
    int left, right, top, bottom;
  };

  [[nodiscard]] std::optional<Bounds> bounds(std::size_t triangle, const RenderWorkspace& workspace) const;
  void draw(std::size_t triangle, RenderWorkspace& workspace, const Bounds& bounds) const;
  void find_visible(RenderWorkspace& workspace) const;
  // What is the same for all of a picture.
  struct Shot {
    Eigen::Matrix3f R_CW;
    float subject_distance2;
    Eigen::Vector2f film_texels;
  };
  [[nodiscard]] float light_at(const Shot& shot, float ray_x, float ray_y,
                               const RenderWorkspace::Triangle& triangle) const noexcept;
  void shade(const Shot& shot, RenderWorkspace& workspace) const;

  ScopeLens lens_;
  std::span<const std::uint32_t> triangles_;
  const TissueTexture& texture_;
  PictureLook look_;
  int stride_ = 0;            // subsamples a row, a multiple of 4
  std::vector<float> ray_x_;  // per subsample: the ray (x, y, 1)
  std::vector<float> ray_y_;
  std::vector<float> vignetting_;  // per pixel, with the field stop
};

}  // namespace perimap
