#include "core/surface/model_mesh.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/surface/six_elements.hpp"
#include "made_organ.hpp"

namespace perimap {
namespace {

using test::kLayout;
using test::MadeOrgan;

constexpr double kPhase_rad = 1.5 * std::numbers::pi;
constexpr double kStep_mm = 4.0;
constexpr std::size_t kSide = 19;  // vertices, so that the model is wider than the features reach

PeriodicSurface fitted(unsigned seed, double deviation_mm = 0.1, double hole_mm = 0.0) {
  std::mt19937_64 random(seed);
  const auto places = test::places_on_disc(100, 35.0, 3.5, random, hole_mm);
  return PeriodicSurface::fit(kLayout, test::evidence_on(places, deviation_mm, random), Vector3d::Zero()).value();
}

Vector2d bearing(std::size_t vertex) {
  const double middle = 0.5 * static_cast<double>(kSide - 1);
  return kStep_mm *
         Vector2d(static_cast<double>(vertex % kSide) - middle, static_cast<double>(vertex / kSide) - middle);
}

Vector3d position(const Vector2d& s, double phase_rad) {
  return MadeOrgan::coefficients(s) * basis_at(kLayout, phase_rad);
}

// The organ's front as it is at the phase of the image, and as much of its back, 150 mm behind.
OrganModel true_model() {
  OrganModel model;
  model.phase_rad = kPhase_rad;
  for (const double behind_mm : {0.0, 150.0}) {
    const auto first = static_cast<std::uint32_t>(model.mesh_W.vertices.size());
    for (std::size_t v = 0; v < kSide * kSide; ++v) {
      model.mesh_W.vertices.push_back(position(bearing(v), kPhase_rad) + behind_mm * Vector3d::UnitZ());
    }
    for (std::size_t row = 0; row + 1 < kSide; ++row) {
      for (std::size_t column = 0; column + 1 < kSide; ++column) {
        const auto a = first + static_cast<std::uint32_t>(row * kSide + column);
        const auto b = a + 1, c = a + static_cast<std::uint32_t>(kSide), d = c + 1;
        const bool front = behind_mm == 0.0;
        for (const auto& [p, q, r] : {std::array{a, b, c}, std::array{b, d, c}}) {
          model.mesh_W.triangles.push_back(front ? TriangleMesh::Triangle{p, r, q} : TriangleMesh::Triangle{p, q, r});
        }
      }
    }
  }
  model.normals_W = vertex_normals(model.mesh_W);
  return model;
}

// Moved along its normals, and as a whole.
OrganModel off_by(OrganModel model, double shape_mm, const Vector3d& registration_mm) {
  for (std::size_t v = 0; v < model.mesh_W.vertices.size(); ++v) {
    model.mesh_W.vertices[v] += shape_mm * model.normals_W[v] + registration_mm;
  }
  return model;
}

Matrix3d covariance_at(const SurfaceMesh& mesh, std::size_t v) {
  return from_six(mesh.covariances_W_mm2.col(static_cast<Eigen::Index>(v)));
}

// Of supported vertices over the cycle.
struct Off {
  std::size_t vertices = 0;
  double rms_mm = 0.0;
  double along_normal_rms_mm = 0.0;
  double nees = 0.0;  // 3 when the covariance is right
};

Off off(const SurfaceMesh& mesh, const OrganModel& model) {
  Off off;
  double sum = 0.0, along = 0.0, nees = 0.0;
  int n = 0;
  for (std::size_t v = 0; v < mesh.support.size(); ++v) {
    if (mesh.support[v] != Support::kSupported) continue;
    ++off.vertices;
    for (int k = 0; k < 12; ++k) {
      const double phase_rad = k * std::numbers::pi / 6.0;
      const Vector3d e =
          mesh.coefficients_W_mm.middleRows<3>(3 * static_cast<Eigen::Index>(v)) * basis_at(kLayout, phase_rad) -
          position(bearing(v), phase_rad);
      sum += e.squaredNorm();
      along += std::pow(e.dot(model.normals_W[v]), 2);
      nees += e.dot(covariance_at(mesh, v).inverse() * e);
      ++n;
    }
  }
  off.rms_mm = std::sqrt(sum / n);
  off.along_normal_rms_mm = std::sqrt(along / n);
  off.nees = nees / n;
  return off;
}

std::size_t within(double radius_mm) {
  std::size_t count = 0;
  for (std::size_t v = 0; v < kSide * kSide; ++v) count += bearing(v).norm() < radius_mm ? 1 : 0;
  return count;
}

TEST(ModelMesh, MovesAsTheOrganDoesWhereFeaturesAre) {
  OrganModel model = true_model();
  model.shape_mm = model.registration_mm = 0.1;
  const SurfaceMesh mesh = mesh_of(fitted(41, 0.05), model);
  EXPECT_EQ(mesh.vertices(), static_cast<Eigen::Index>(2 * kSide * kSide)) << "all, in the model's order";
  const Off found = off(mesh, model);
  EXPECT_GT(found.vertices, 0.95 * static_cast<double>(within(32.0)));
  EXPECT_LT(found.rms_mm, 0.12);
}

TEST(ModelMesh, SaysOfWhatNobodySeesThatItIsNotKnown) {
  const OrganModel model = true_model();
  const PeriodicSurface surface = fitted(42, 0.1, 22.0);
  const SurfaceMesh mesh = mesh_of(surface, model);
  const double farthest_mm = 35.0 + surface.support().reach_mm() + 8.0;
  const double hole_mm = 22.0 - surface.support().reach_mm() - 4.0;
  ASSERT_GT(hole_mm, 3.0);
  for (std::size_t v = 0; v < mesh.support.size(); ++v) {
    const double r = bearing(v % (kSide * kSide)).norm();
    const bool behind = v >= kSide * kSide;
    if (behind || r > farthest_mm || r < hole_mm) {
      EXPECT_EQ(mesh.support[v], Support::kUncertain) << v;
    }
    if (!behind) continue;
    EXPECT_EQ(
        mesh.coefficients_W_mm.middleRows<3>(3 * static_cast<Eigen::Index>(v)).rightCols(kLayout.size() - 1).norm(),
        0.0);
    EXPECT_GT(covariance_at(mesh, v).trace(), 4.0) << "it may move as what is seen does";
  }
  ASSERT_FALSE(mesh.triangles.empty());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) EXPECT_EQ(mesh.support[v], Support::kSupported);
  }
}

// Of a model that is 2 mm too thick the surface is where it is seen.
TEST(ModelMesh, LiesOnTheSurfaceThatIsSeen) {
  OrganModel model = off_by(true_model(), 2.0, Vector3d::Zero());
  model.shape_mm = 2.0;
  model.registration_mm = 0.2;
  const Off found = off(mesh_of(fitted(43), model), model);
  EXPECT_GT(found.vertices, 0.9 * static_cast<double>(within(32.0)));
  EXPECT_LT(found.along_normal_rms_mm, 0.35);
}

TEST(ModelMesh, IsAsUncertainAsItIsOff) {
  std::mt19937_64 random(44);
  std::normal_distribution<double> normal;
  constexpr int kTrials = 40;
  double nees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    OrganModel model = true_model();
    model.shape_mm = 1.0;
    model.registration_mm = 0.8;
    const double shape_mm = model.shape_mm * normal(random);
    const Vector3d registration_mm = model.registration_mm * Vector3d(normal(random), normal(random), normal(random));
    model = off_by(model, shape_mm, registration_mm);
    nees += off(mesh_of(fitted(100 + static_cast<unsigned>(trial)), model), model).nees / 3.0 / kTrials;
  }
  EXPECT_GT(nees, 0.6);
  EXPECT_LT(nees, 1.4);
}

TEST(ModelMesh, ShowsNothingOfAModelThatTheSurfaceContradicts) {
  OrganModel model = off_by(true_model(), 8.0, Vector3d::Zero());
  model.shape_mm = model.registration_mm = 0.5;
  const SurfaceMesh mesh = mesh_of(fitted(45), model);
  EXPECT_TRUE(mesh.triangles.empty());
  EXPECT_EQ(std::count(mesh.support.begin(), mesh.support.end(), Support::kSupported), 0);
}

// With the model at the wrong phase its places are those of another one.
TEST(ModelMesh, GoesByThePhaseOfItsImage) {
  OrganModel model = true_model();
  model.shape_mm = model.registration_mm = 2.0;
  const PeriodicSurface surface = fitted(46, 0.05);
  const double right_mm = off(mesh_of(surface, model), model).rms_mm;
  model.phase_rad = kPhase_rad - std::numbers::pi;
  EXPECT_GT(off(mesh_of(surface, model), model).rms_mm, 4.0 * right_mm);
}

TEST(ModelMesh, OfAnEmptyNeighbourhoodNothingIsComputed) {
  OrganModel model = off_by(true_model(), 0.0, {0.0, 400.0, 0.0});
  const SurfaceMesh mesh = mesh_of(fitted(47), model);
  EXPECT_TRUE(mesh.triangles.empty());
  EXPECT_TRUE(mesh.coefficients_W_mm.allFinite());
  EXPECT_TRUE(mesh.covariances_W_mm2.allFinite());
}

}  // namespace
}  // namespace perimap
