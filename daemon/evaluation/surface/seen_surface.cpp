#include "daemon/evaluation/surface/seen_surface.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace perimap {
namespace {

constexpr double kAreaAPoint_mm2 = 2.0;
// Of a mesh that is no heart's.
constexpr double kMostPoints = 40000.0;
constexpr int kSightings = 3;
constexpr double kRim_mm = 5.0;
constexpr double kObliquest = 0.5;  // cosine of the angle between ray and normal
// What is met first lies so near to the point that it is the point, on the next triangle perhaps.
constexpr double kSamePlace_mm = 0.3;

// Evenly in [0, 1), the same with every library.
double unit(std::mt19937_64& random) { return static_cast<double>(random() >> 11U) * 0x1.0p-53; }

}  // namespace

SeenSurface::SeenSurface(const GroundTruth& truth, const CameraModel& camera) : truth_(truth), camera_(camera) {
  draw_points();
  find_neighbours();
  sightings_.assign(points_.size(), 0);
  good_sightings_.assign(points_.size(), 0);
}

void SeenSurface::draw_points() {
  const HeartMesh& mesh = truth_.mesh();
  const std::size_t n = mesh.coefficients_per_axis();
  // The mean of sin^4, by which breathing moves.
  const Vector3d breath = truth_.motion().respiration_period > Duration(0)
                              ? Vector3d(0.375 * truth_.motion().respiration_mm)
                              : Vector3d::Zero();
  std::vector<Vector3d>& means = mean_vertices_;
  for (std::size_t vertex = 0; vertex < mesh.vertex_count; ++vertex) {
    const double* c = mesh.coefficients_mm.data() + vertex * 3 * n;
    means.emplace_back(Vector3d(c[0], c[n], c[2 * n]) + breath);
  }
  std::vector<double> areas;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const Vector3d& p = means[mesh.triangles[i]];
    areas.push_back(0.5 * (means[mesh.triangles[i + 1]] - p).cross(means[mesh.triangles[i + 2]] - p).norm());
  }
  std::vector<double> up_to(areas.size());
  std::partial_sum(areas.begin(), areas.end(), up_to.begin());
  std::mt19937_64 random(1);
  if (!(up_to.back() > 0.0)) return;
  const auto count = static_cast<std::size_t>(std::min(up_to.back() / kAreaAPoint_mm2, kMostPoints));
  for (std::size_t i = 0; i < count; ++i) {
    const auto triangle = static_cast<std::size_t>(
        std::upper_bound(up_to.begin(), up_to.end(), unit(random) * up_to.back()) - up_to.begin());
    const double root = std::sqrt(unit(random));
    const double share = unit(random);
    SurfacePoint point;
    point.triangle = static_cast<std::uint32_t>(std::min(triangle, areas.size() - 1));
    point.barycentric = {1.0 - root, root * (1.0 - share), root * share};
    points_.push_back(point);
    mean_places_.emplace_back(Vector3d::Zero());
    mean_places_.back() = position(i, means);
  }
}

void SeenSurface::find_neighbours() {
  neighbours_.resize(points_.size());
  std::vector<std::uint32_t> order(points_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [this](std::uint32_t a, std::uint32_t b) { return mean_places_[a].x() < mean_places_[b].x(); });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Vector3d& p = mean_places_[order[i]];
    for (std::size_t j = i + 1; j < order.size() && mean_places_[order[j]].x() - p.x() < kRim_mm; ++j) {
      if ((mean_places_[order[j]] - p).squaredNorm() >= kRim_mm * kRim_mm) continue;
      neighbours_[order[i]].push_back(order[j]);
      neighbours_[order[j]].push_back(order[i]);
    }
  }
}

Vector3d SeenSurface::position(std::size_t point, const std::vector<Vector3d>& vertices) const noexcept {
  const SurfacePoint& at = points_[point];
  Vector3d p = Vector3d::Zero();
  for (std::size_t corner = 0; corner < 3; ++corner) {
    p += at.barycentric[corner] * vertices[truth_.mesh().triangles[3 * std::size_t{at.triangle} + corner]];
  }
  return p;
}

SeenSurface::Sight SeenSurface::sight_of(std::size_t point, const std::vector<Vector3d>& vertices_C,
                                         const SurfaceView& view) const noexcept {
  const SurfacePoint& at = points_[point];
  const std::uint32_t* corners = truth_.mesh().triangles.data() + 3 * std::size_t{at.triangle};
  const Vector3d& a = vertices_C[corners[0]];
  const Vector3d normal = (vertices_C[corners[1]] - a).cross(vertices_C[corners[2]] - a);
  const Vector3d p_C = position(point, vertices_C);
  if (normal.dot(p_C) >= 0.0) return Sight::kNone;
  Vector2d px;
  if (camera_.project(p_C, px) != ProjectionStatus::kOk || !camera_.contains(px)) return Sight::kNone;
  if (!is_first(point, vertices_C, view)) return Sight::kNone;
  return -normal.dot(p_C) >= kObliquest * normal.norm() * p_C.norm() ? Sight::kWell : Sight::kOblique;
}

bool SeenSurface::is_first(std::size_t point, const std::vector<Vector3d>& vertices,
                           const SurfaceView& view) const noexcept {
  const Vector3d p = position(point, vertices);
  const auto hit = view.first_hit(p);
  if (!hit) return false;
  if (hit->triangle == points_[point].triangle) return true;
  Vector3d first = Vector3d::Zero();
  for (std::size_t corner = 0; corner < 3; ++corner) {
    first += hit->barycentric[corner] * vertices[truth_.mesh().triangles[3 * std::size_t{hit->triangle} + corner]];
  }
  return (first - p).norm() < kSamePlace_mm;
}

std::vector<bool> SeenSurface::in_front_of(const Vector3d& place_W) const {
  std::vector<Vector3d> vertices = mean_vertices_;
  for (Vector3d& p : vertices) p -= place_W;
  const SurfaceView view(vertices, truth_.mesh().triangles);
  std::vector<bool> front;
  for (const std::size_t point : seen_) front.push_back(is_first(point, vertices, view));
  return front;
}

void SeenSurface::look(Instant capture) {
  const auto X_WC = truth_.camera_pose(capture);
  if (!X_WC) return;
  std::vector<Vector3d> vertices(truth_.mesh().vertex_count);
  truth_.vertices_at(capture, vertices);
  const Pose X_CW = X_WC->inverse();
  for (Vector3d& p : vertices) p = X_CW * p;
  const SurfaceView view(vertices, truth_.mesh().triangles);
  for (std::size_t point = 0; point < points_.size(); ++point) {
    if (seen_well(point)) continue;
    const Sight sight = sight_of(point, vertices, view);
    if (sight == Sight::kNone) continue;
    if (++sightings_[point] == kSightings) seen_.push_back(point);
    if (sight == Sight::kWell) ++good_sightings_[point];
  }
}

bool SeenSurface::seen_well(std::size_t point) const noexcept { return good_sightings_[point] >= kSightings; }

bool SeenSurface::on_rim(std::size_t point) const noexcept {
  return !seen_well(point) || std::any_of(neighbours_[point].begin(), neighbours_[point].end(),
                                          [this](std::uint32_t other) { return !seen_well(other); });
}

}  // namespace perimap
