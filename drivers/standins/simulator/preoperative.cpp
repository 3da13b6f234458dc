#include "drivers/standins/simulator/preoperative.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/geometry/nearest_triangle.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/second_heart.hpp"

namespace perimap {
namespace {

enum PreoperativeStream : std::uint64_t { kScanFrame = 7100, kScanOffset, kScanShape, kScanMotion };

Vector3d drawn_direction(const CounterNoise& noise, std::uint64_t index) {
  return Vector3d(noise.normal(index), noise.normal(index + 1), noise.normal(index + 2)).normalized();
}

// A smooth field of RMS 1 over the vertices: waves whose vectors are drawn from a normal distribution, so that it is
// correlated as exp(-d^2 / 2 l^2) (Rahimi & Recht, NIPS 2007).
std::vector<double> smooth_field(const std::vector<Vector3d>& places, double length_mm, const CounterNoise& noise) {
  constexpr std::uint64_t kWaves = 128;
  std::vector<double> field(places.size(), 0.0);
  for (std::uint64_t wave = 0; wave < kWaves; ++wave) {
    const Vector3d k =
        Vector3d(noise.normal(4 * wave), noise.normal(4 * wave + 1), noise.normal(4 * wave + 2)) / length_mm;
    const double phase = noise.uniform(8 * kWaves + 2 * wave, 0.0, 2.0 * std::numbers::pi);
    for (std::size_t v = 0; v < places.size(); ++v) field[v] += std::cos(k.dot(places[v]) + phase);
  }
  double squares = 0.0;
  for (const double value : field) squares += value * value;
  const double scale = 1.0 / std::sqrt(squares / static_cast<double>(field.size()));
  for (double& value : field) value *= scale;
  return field;
}

// From each vertex' place at one phase to that at another, as a second heart moves at the same place of it, whose
// middle is the first one's.
std::vector<Vector3d> displaced_as_another(const HeartMesh& heart_W, std::uint64_t seed, double from_rad,
                                           double to_rad) {
  const TriangleMesh here = surface_at(at_rest(heart_W), 0.0);
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& vertex : here.vertices) middle += vertex / static_cast<double>(here.vertices.size());
  const HeartMesh other = second_heart(seed);
  const TriangleMesh there = surface_at(at_rest(other), 0.0);
  const TriangleMesh from = surface_at(other, from_rad);
  const TriangleMesh to = surface_at(other, to_rad);
  const NearestTriangle nearest(there);
  std::vector<Vector3d> displaced;
  for (const Vector3d& vertex : here.vertices) {
    const NearestPlace place = nearest.to(vertex - middle);
    Vector3d d = Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = there.triangles[place.triangle][k];
      d += place.shares[static_cast<Eigen::Index>(k)] * (to.vertices[v] - from.vertices[v]);
    }
    displaced.push_back(d);
  }
  return displaced;
}

// The model's vertices at another phase, in the frame of the heart.
std::vector<Vector3d> moved_to(double phase_rad, const HeartMesh& heart_W, const TriangleMesh& scanned_W,
                               const PreoperativeSettings& settings) {
  const double from_rad = settings.phase_rad + settings.motion_shift_rad;
  const double to_rad = phase_rad + settings.motion_shift_rad;
  std::vector<Vector3d> displaced;
  if (settings.other_motion) {
    displaced = displaced_as_another(heart_W, settings.seed, from_rad, to_rad);
  } else {
    displaced = surface_at(heart_W, to_rad).vertices;
    const std::vector<Vector3d> from = surface_at(heart_W, from_rad).vertices;
    for (std::size_t v = 0; v < displaced.size(); ++v) displaced[v] -= from[v];
  }
  std::vector<double> share(displaced.size(), 0.0);
  if (settings.motion_error > 0.0) {
    share = smooth_field(scanned_W.vertices, settings.shape_length_mm, CounterNoise(settings.seed, kScanMotion));
  }
  std::vector<Vector3d> vertices = scanned_W.vertices;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    vertices[v] += settings.motion_scale * (1.0 + settings.motion_error * share[v]) * displaced[v];
  }
  return vertices;
}

std::string registration_text(const Pose& X_IW, const std::string& covariance, const Vector3d& middle_I) {
  double q[4];
  rotation_to_wxyz(X_IW.R, q);
  return fmt::format(
      "{{\n  \"translation_mm\": [{}, {}, {}],\n  \"rotation_wxyz\": [{}, {}, {}, {}],\n  \"covariance\": {},\n"
      "  \"covariance_about_mm\": [{}, {}, {}]\n}}\n",
      X_IW.t.x(), X_IW.t.y(), X_IW.t.z(), q[0], q[1], q[2], q[3], covariance, middle_I.x(), middle_I.y(), middle_I.z());
}

}  // namespace

PreoperativeModel preoperative_model(const HeartMesh& heart_W, const PreoperativeSettings& settings) {
  TriangleMesh mesh = surface_at(heart_W, settings.phase_rad);
  if (settings.shape_error_mm > 0.0) {
    const std::vector<Vector3d> normals = vertex_normals(mesh);
    const std::vector<double> field =
        smooth_field(mesh.vertices, settings.shape_length_mm, CounterNoise(settings.seed, kScanShape));
    for (std::size_t v = 0; v < field.size(); ++v) mesh.vertices[v] += settings.shape_error_mm * field[v] * normals[v];
  }
  PreoperativeModel model;
  const CounterNoise frame(settings.seed, kScanFrame);
  model.true_X_IW = {so3_exp(frame.uniform(30, 0.5, 2.5) * drawn_direction(frame, 0)),
                     frame.uniform(31, 50.0, 250.0) * drawn_direction(frame, 10)};
  for (const double phase_rad : settings.other_phases_rad) {
    TriangleMesh other{moved_to(phase_rad, heart_W, mesh, settings), mesh.triangles};
    for (Vector3d& vertex : other.vertices) vertex = model.true_X_IW * vertex;
    model.others_I.push_back(std::move(other));
  }
  for (Vector3d& vertex : mesh.vertices) {
    vertex = model.true_X_IW * vertex;
    model.middle_I += vertex / static_cast<double>(mesh.vertices.size());
  }
  model.mesh_I = std::move(mesh);
  const CounterNoise off(settings.seed, kScanOffset);
  const Matrix3d R = so3_exp(settings.off_rad * drawn_direction(off, 0));
  model.start_X_IW =
      Pose{R, model.middle_I + settings.off_mm * drawn_direction(off, 10) - R * model.middle_I} * model.true_X_IW;
  return model;
}

std::string true_registration_of(const PreoperativeModel& model) {
  return registration_text(model.true_X_IW, "null", model.middle_I);
}

std::string start_registration_of(const PreoperativeModel& model, const PreoperativeSettings& settings) {
  // Of a direction that may be any, each axis has a third of the square.
  const double rotation = settings.off_rad * settings.off_rad / 3.0;
  const double translation = settings.off_mm * settings.off_mm / 3.0;
  std::string rows;
  for (int i = 0; i < 6; ++i) {
    std::array<double, 6> row{};
    row[static_cast<std::size_t>(i)] = i < 3 ? rotation : translation;
    rows +=
        fmt::format("{}[{}, {}, {}, {}, {}, {}]", i == 0 ? "" : ", ", row[0], row[1], row[2], row[3], row[4], row[5]);
  }
  return registration_text(model.start_X_IW, "[" + rows + "]", model.middle_I);
}

}  // namespace perimap
