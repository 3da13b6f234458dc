#include "drivers/standins/truth/heart_mesh.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "drivers/standins/simulator/embedded_data.hpp"

namespace perimap {
namespace {

HeartMesh epicardium() {
  auto mesh = parse_heart_mesh(embedded_epicardium_fourier_csv(), embedded_epicardium_faces_csv());
  EXPECT_TRUE(mesh.has_value()) << (mesh ? "" : mesh.error().message);
  return *std::move(mesh);
}

std::vector<Vector3d> positions(const HeartMesh& mesh, double phase) {
  std::vector<Vector3d> p(mesh.vertex_count);
  vertex_positions(mesh, fourier_basis(phase, mesh.harmonics), p);
  return p;
}

TEST(HeartMesh, HoldsTheWholeEpicardium) {
  const HeartMesh mesh = epicardium();
  EXPECT_EQ(mesh.vertex_count, 2502U);
  EXPECT_EQ(mesh.triangles.size(), 3 * 4864U);
  EXPECT_EQ(mesh.harmonics, 4U);
}

TEST(HeartMesh, TrianglesAreOrientedAlikeAndOutward) {
  const HeartMesh mesh = epicardium();
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto from = mesh.triangles[t + i];
      const auto to = mesh.triangles[t + (i + 1) % 3];
      EXPECT_TRUE(edges.emplace(from, to).second) << "edge " << from << " -> " << to << " is walked twice the same way";
    }
  // Outward: the volume between the surface and a point inside is positive at every phase.
  for (const double phase : {0.0, 2.0, 4.0}) {
    const auto p = positions(mesh, phase);
    Vector3d centre = Vector3d::Zero();
    for (const Vector3d& v : p) centre += v / static_cast<double>(p.size());
    double volume_mm3 = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
      volume_mm3 += (p[mesh.triangles[t]] - centre)
                        .dot((p[mesh.triangles[t + 1]] - centre).cross(p[mesh.triangles[t + 2]] - centre)) /
                    6.0;
    EXPECT_GT(volume_mm3, 200e3);
  }
}

TEST(HeartMesh, FollowsTheTablesOwnFormula) {
  const HeartMesh mesh = parse_heart_mesh(
                             "vertex,axis,c0,a1,b1,a2,b2,a3,b3,a4,b4\n"
                             "0,x,1,2,3,4,5,6,7,8,9\n0,y,0,0,1,0,0,0,0,0,0\n0,z,-1,0,0,0,0,0,0,0,.5\n",
                             "v0,v1,v2\n0,0,0\n")
                             .value();
  const double p = 0.3;
  const auto angle = [p](int h) { return 2.0 * std::numbers::pi * h * p; };
  const double x = 1 + 2 * std::cos(angle(1)) + 3 * std::sin(angle(1)) + 4 * std::cos(angle(2)) +
                   5 * std::sin(angle(2)) + 6 * std::cos(angle(3)) + 7 * std::sin(angle(3)) + 8 * std::cos(angle(4)) +
                   9 * std::sin(angle(4));
  const Vector3d got = vertex_position(mesh, fourier_basis(2.0 * std::numbers::pi * p, 4), 0);
  EXPECT_NEAR(got.x(), x, 1e-12);
  EXPECT_NEAR(got.y(), std::sin(angle(1)), 1e-12);
  EXPECT_NEAR(got.z(), -1 + 0.5 * std::sin(angle(4)), 1e-12);
}

TEST(HeartMesh, MovesRigidlyWhenTransformed) {
  const HeartMesh mesh_H = epicardium();
  const Pose X_WH{so3_exp(Vector3d(0.3, -1.0, 0.7)), Vector3d(10.0, -20.0, 30.0)};
  const auto p_H = positions(mesh_H, 1.3);
  const auto p_W = positions(transformed(X_WH, mesh_H), 1.3);
  for (std::size_t i = 0; i < p_H.size(); i += 100) EXPECT_LT((X_WH * p_H[i] - p_W[i]).norm(), 1e-10);
}

TEST(HeartMesh, NamesFileAndLineOfABadTable) {
  const char* header = "vertex,axis,c0,a1,b1,a2,b2,a3,b3,a4,b4\n";
  const auto error = [&](const std::string& rows, const std::string& faces) {
    const auto mesh = parse_heart_mesh(header + rows, faces);
    return mesh ? std::string("no error") : mesh.error().message;
  };
  const std::string vertex = "0,x,1,2,3,4,5,6,7,8,9\n0,y,1,2,3,4,5,6,7,8,9\n0,z,1,2,3,4,5,6,7,8,9\n";
  EXPECT_EQ(error("0,x,1,2,oops,4,5,6,7,8,9\n", ""), "epi_fourier_H4.csv:2:9: expected a number, found 'oops'");
  EXPECT_EQ(error("0,y,1,2,3,4,5,6,7,8,9\n", ""),
            "epi_fourier_H4.csv:2:3: expected the vertices in order, axes x, y, z of each");
  EXPECT_EQ(error(vertex, "v0,v1,v2\n0,0,1\n"), "heart mesh: triangle index 1 is not below the vertex count 1");
  EXPECT_EQ(error(vertex, "v0,v1,v2\n"), "heart mesh: 0 triangle indices, expected a multiple of 3");
}

}  // namespace
}  // namespace perimap
