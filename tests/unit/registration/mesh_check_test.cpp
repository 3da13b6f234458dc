// Meshes that are no organ's surface are refused with what is wrong and where.
#include "core/registration/mesh_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "made_model.hpp"

namespace perimap::test {
namespace {

using testing::HasSubstr;

std::string refusal(TriangleMesh mesh) {
  const auto checked = check_mesh(std::move(mesh));
  return checked ? "none" : checked.error().message;
}

TEST(MeshCheck, ASoundMeshIsTakenAsItIs) {
  const TriangleMesh egg = made_egg();
  const auto checked = check_mesh(egg);
  ASSERT_TRUE(checked) << checked.error().message;
  EXPECT_EQ(checked->mesh.vertices.size(), egg.vertices.size());
  EXPECT_EQ(checked->mesh.triangles, egg.triangles);
  EXPECT_EQ(checked->border_edges, 0U);
  EXPECT_TRUE(checked->doubts.empty());
}

TEST(MeshCheck, CornersAtOnePlaceBecomeOneVertex) {
  const TriangleMesh egg = made_egg();
  TriangleMesh soup;
  for (const auto& triangle : egg.triangles) {
    for (const std::uint32_t v : triangle) soup.vertices.push_back(egg.vertices[v]);
    const auto n = static_cast<std::uint32_t>(soup.vertices.size());
    soup.triangles.push_back({n - 3, n - 2, n - 1});
  }
  const auto checked = check_mesh(soup);
  ASSERT_TRUE(checked) << checked.error().message;
  EXPECT_EQ(checked->mesh.vertices.size(), egg.vertices.size());
  EXPECT_EQ(checked->border_edges, 0U);
}

TEST(MeshCheck, AnOpenMeshIsTakenAndItsBorderCounted) {
  const auto checked = check_mesh(made_egg(40, 60, 8));
  ASSERT_TRUE(checked) << checked.error().message;
  EXPECT_EQ(checked->border_edges, 60U);
}

TEST(MeshCheck, WhatIsNoSurfaceOfAnOrganIsRefused) {
  const TriangleMesh egg = made_egg();
  const auto changed = [&](const auto& change) {
    TriangleMesh mesh = egg;
    change(mesh);
    return refusal(std::move(mesh));
  };
  const auto scaled = [&](double by) {
    return changed([&](TriangleMesh& m) {
      for (Vector3d& p : m.vertices) p *= by;
    });
  };
  EXPECT_EQ(refusal({}), "has no triangle");
  EXPECT_THAT(changed([](TriangleMesh& m) { m.vertices[17].y() = std::numeric_limits<double>::quiet_NaN(); }),
              HasSubstr("vertex 17 is no number"));
  EXPECT_THAT(changed([](TriangleMesh& m) { m.triangles[5][1] = 99999; }), HasSubstr("triangle 5 has vertex 99999"));
  EXPECT_THAT(changed([](TriangleMesh& m) {
                m.triangles.assign(2'000'001, {0, 1, 2});
              }),
              HasSubstr("has 2000001 triangles, and at most 2000000 are taken"));
  EXPECT_THAT(changed([](TriangleMesh& m) {
                m.triangles = {{0, 0, 1}, {1, 2, 1}};
              }),
              HasSubstr("no triangle with an area"));
  EXPECT_THAT(scaled(1e-3), HasSubstr("are its lengths in metres? Then its unit is m"));
  EXPECT_THAT(scaled(1e3), HasSubstr("are its lengths in mm? Then its unit is mm"));
  EXPECT_THAT(changed([](TriangleMesh& m) {
                for (Vector3d& p : m.vertices) p.x() = -p.x();
              }),
              HasSubstr("face inwards: it is mirrored, or inside out"));
  EXPECT_THAT(changed([](TriangleMesh& m) {
                for (auto& t : m.triangles) std::swap(t[0], t[1]);
              }),
              HasSubstr("face inwards"));
  EXPECT_THAT(changed([](TriangleMesh& m) {
                for (std::size_t t = 0; t < m.triangles.size(); t += 3) std::swap(m.triangles[t][0], m.triangles[t][1]);
              }),
              HasSubstr("both triangles face opposite sides, the first one from ("));
  EXPECT_THAT(changed([](TriangleMesh& m) {
                const auto all = m.triangles;
                for (std::size_t t = 0; t < all.size(); t += 4) m.triangles.push_back(all[t]);
              }),
              HasSubstr("is no manifold: "));
}

TEST(MeshCheck, AFewOddEdgesAreADoubt) {
  TriangleMesh mesh = made_egg();
  mesh.vertices.emplace_back(0.0, 0.0, 0.0);
  mesh.triangles.push_back(
      {mesh.triangles[0][0], mesh.triangles[0][1], static_cast<std::uint32_t>(mesh.vertices.size() - 1)});
  const auto checked = check_mesh(mesh);
  ASSERT_TRUE(checked) << checked.error().message;
  ASSERT_EQ(checked->doubts.size(), 1U);
  EXPECT_THAT(checked->doubts[0], HasSubstr("is no manifold: 1 of "));
}

}  // namespace
}  // namespace perimap::test
