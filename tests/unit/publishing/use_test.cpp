// What a subscriber's header, and the words of perimap, make of the uses that a surface is published with.
#include <gtest/gtest.h>

#include <perimap_use.hpp>

#include "core/pipeline/surface_use.hpp"
#include "daemon/publishing/use_text.hpp"

namespace perimap {
namespace {

using client::Use;

perimap_Surface surface_with_uses() {
  perimap_Surface surface{};
  surface.display_state = perimap_SURFACE_GOOD;
  surface.measure_state = perimap_SURFACE_GOOD;
  surface.contact_state = perimap_SURFACE_DEGRADED;
  const double within_mm[3] = {5.0, 3.0, 1.5};
  const std::uint32_t features[3] = {31, 30, 4};
  for (int i = 0; i < 3; ++i) surface.use_within_mm[i] = within_mm[i];
  for (int i = 0; i < 3; ++i) surface.use_features[i] = features[i];
  return surface;
}

perimap_SurfaceFeature converged_feature(double variance_mm2) {
  perimap_SurfaceFeature feature{};
  feature.state = perimap_FEATURE_CONVERGED;
  feature.covariance_W_mm2[0] = feature.covariance_W_mm2[3] = feature.covariance_W_mm2[5] = variance_mm2;
  return feature;
}

TEST(Use, ThePositionsThatMayBeUsedAreThoseWithinTheBoundOfASurfaceThatIsGoodForIt) {
  const perimap_Surface surface = surface_with_uses();
  EXPECT_TRUE(usable_for(surface, converged_feature(0.5), Use::kMeasure));
  EXPECT_FALSE(usable_for(surface, converged_feature(1.0), Use::kMeasure)) << "3.5 mm";
  EXPECT_TRUE(usable_for(surface, converged_feature(1.0), Use::kDisplay));
  EXPECT_FALSE(usable_for(surface, converged_feature(0.01), Use::kContact)) << "the surface is not";
  perimap_SurfaceFeature converging = converged_feature(0.01);
  converging.state = perimap_FEATURE_CONVERGING;
  EXPECT_FALSE(usable_for(surface, converging, Use::kDisplay));
}

TEST(Use, OfAnOlderPerimapdNothingIsTold) {
  const perimap_Surface surface{};
  for (const Use use : {Use::kDisplay, Use::kMeasure, Use::kContact}) {
    EXPECT_EQ(client::state_for(surface, use), perimap_SURFACE_INVALID);
    EXPECT_FALSE(usable_for(surface, converged_feature(0.01), use));
  }
  EXPECT_FALSE(uses_of(surface).has_value());
}

TEST(Use, TheHeaderReckonsAsThePipelineDoes) {
  Matrix3d P;
  P << 0.5, 0.1, 0.0, 0.1, 0.7, 0.2, 0.0, 0.2, 1.1;
  const double upper[6] = {P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)};
  EXPECT_DOUBLE_EQ(client::within_mm(upper), within_mm(P));
}

TEST(Use, IsSaidInWords) {
  const auto uses = uses_of(surface_with_uses());
  ASSERT_TRUE(uses.has_value());
  EXPECT_EQ(uses_words(*uses),
            "show good (31 within 5 mm), measure good (30 within 3 mm), contact degraded (4 within 1.5 mm)");
  EXPECT_EQ(uses_json(*uses)["measure"]["features"], 30);
}

}  // namespace
}  // namespace perimap
