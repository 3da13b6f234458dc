#include <gtest/gtest.h>

#include "core/surface/surface_mesh.hpp"
#include "counted_allocations.hpp"
#include "made_organ.hpp"

namespace perimap {
namespace {

TEST(SurfaceAllocation, EvaluatingTakesNoMemory) {
  std::mt19937_64 random(51);
  const auto evidence = test::evidence_on(test::places_on_disc(60, 40.0, 3.5, random), 0.1, random);
  const auto surface = PeriodicSurface::fit(test::kLayout, evidence, Vector3d::Zero());
  ASSERT_TRUE(surface.has_value());
  const SurfaceMesh mesh = mesh_of(*surface, 2000);
  EvaluatedSurface evaluated(mesh);
  const Basis b = basis_at(test::kLayout, 0.4);
  const Basis rate = basis_rate(test::kLayout, 0.4);
  double sum = 0.0;
  const long taken = test::allocations_of([&] {
    for (int i = 0; i < 10; ++i) {
      evaluated.evaluate(mesh, b, rate, 0.01);
      sum += evaluated.positions().col(i).sum() + evaluated.deviations()(i);
    }
  });
  EXPECT_EQ(taken, 0);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace perimap
