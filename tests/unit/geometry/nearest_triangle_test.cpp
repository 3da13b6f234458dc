#include "core/geometry/nearest_triangle.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "made_egg.hpp"

namespace perimap::test {
namespace {

TEST(NearestTriangle, IsTheNearestOfAll) {
  const TriangleMesh egg = made_egg(20, 24);
  const NearestTriangle nearest(egg);
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(-80.0, 80.0);
  for (int i = 0; i < 200; ++i) {
    const Vector3d p(uniform(random), uniform(random), uniform(random));
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [a, b, c] : egg.triangles) {
      // Densely over the triangle: no nearer place than the one found, and one that is hardly further.
      for (int u = 0; u <= 20; ++u) {
        for (int v = 0; u + v <= 20; ++v) {
          const Vector3d q = egg.vertices[a] + u / 20.0 * (egg.vertices[b] - egg.vertices[a]) +
                             v / 20.0 * (egg.vertices[c] - egg.vertices[a]);
          least = std::min(least, (q - p).norm());
        }
      }
    }
    const NearestPlace place = nearest.to(p);
    EXPECT_LE((place.point - p).norm(), least + 1e-9);
    EXPECT_GE((place.point - p).norm(), least - 0.5);
    EXPECT_FALSE(place.on_border);
  }
}

TEST(NearestTriangle, KnowsWhereTheMeshEnds) {
  const TriangleMesh egg = made_egg(40, 60, 8);
  const NearestTriangle nearest(egg);
  EXPECT_TRUE(nearest.to({0.0, 0.0, 90.0}).on_border);
  EXPECT_FALSE(nearest.to({60.0, 0.0, 0.0}).on_border);
  EXPECT_GT(nearest.to({60.0, 0.0, 0.0}).normal.x(), 0.9);
}

}  // namespace
}  // namespace perimap::test
