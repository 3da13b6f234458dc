#include "daemon/subscribing/shown_surface.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "made_publication.hpp"

namespace perimap {
namespace {

using namespace std::chrono_literals;
using test::MadePublication;

const Instant kNow = from_ns(0) + 100'350ms;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

class ShownSurfaces : public testing::Test {
 protected:
  void keep_mesh() {
    gate_.take(test::owned(made_.model_at(kNow, 1)));
    gate_.take(test::owned(made_.mesh_at(kNow, 1)));
  }
  static void expect_nothing(const ShownSurface& shown) {
    EXPECT_EQ(shown.state, perimap_SURFACE_INVALID);
    EXPECT_FALSE(shown.usable());
    EXPECT_TRUE(shown.features.empty());
    EXPECT_TRUE(shown.mesh.positions_W_mm.empty());
    EXPECT_TRUE(shown.mesh.triangles.empty());
    EXPECT_FALSE(shown.X_WC);
    EXPECT_NE(shown.why, "");
  }

  MadePublication made_;
  SurfaceGate gate_;
};

TEST_F(ShownSurfaces, HaveTheFeaturesThatMayBeShownAndWhereTheCameraWas) {
  const ShownSurface shown = gate_.show(made_.surface_at(kNow, 7), kNow);
  EXPECT_EQ(shown.state, perimap_SURFACE_GOOD);
  EXPECT_EQ(shown.why, "");
  EXPECT_EQ(shown.why_no_mesh, "no mesh has come yet");
  ASSERT_EQ(shown.features.size(), 3U);  // not the invalid one
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(shown.features[i].id, 10 + i);
    EXPECT_EQ(shown.features[i].position_W_mm, MadePublication::feature_at(i, kNow));
    EXPECT_NEAR(shown.features[i].deviation_mm, MadePublication::kFeatureDeviation_mm, 1e-12);
  }
  ASSERT_TRUE(shown.X_WC);
  EXPECT_LT((*shown.X_WC * Vector3d(1, 0, 0) - Vector3d(1, -1, 30)).norm(), 1e-12);
  EXPECT_EQ(shown.utc_minus_monotonic.count(), MadePublication::kUtcMinusMonotonic_ns);
}

TEST_F(ShownSurfaces, HaveTheSupportedVerticesOfTheMeshAtTheirInstant) {
  keep_mesh();
  const Instant valid = kNow + 130ms;
  const ShownSurface shown = gate_.show(made_.surface_at(valid, 7), kNow);
  EXPECT_EQ(shown.state, perimap_SURFACE_GOOD);
  EXPECT_EQ(shown.why_no_mesh, "");
  ASSERT_EQ(shown.mesh.positions_W_mm.size(), 4U);  // not the uncertain one
  ASSERT_EQ(shown.mesh.triangles.size(), 2U);
  // Vertices come in the order of the triangles (1 2 3)(2 4 3).
  for (std::size_t v = 0; v < 4; ++v) {
    const auto expected = MadePublication::vertex_at(v + 1, valid);
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(shown.mesh.positions_W_mm[v][axis], expected[axis], 1e-4);
    EXPECT_NEAR(shown.mesh.deviations_mm[v], 0.2, 1e-6);
  }
  EXPECT_EQ(shown.mesh.triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
  EXPECT_EQ(shown.mesh.triangles[1], (std::array<std::uint32_t, 3>{1, 3, 2}));
}

TEST_F(ShownSurfaces, OfAnInvalidOneThereIsNothing) {
  keep_mesh();
  for (const auto state : {perimap_SURFACE_INVALID, static_cast<perimap_SurfaceState>(3)}) {
    perimap_Surface& surface = made_.surface_at(kNow, 7);
    surface.state = state;
    surface.reason = perimap_SURFACE_REASON_PHASE_LOST;
    const ShownSurface shown = gate_.show(surface, kNow);
    expect_nothing(shown);
    EXPECT_EQ(shown.reason, perimap_SURFACE_REASON_PHASE_LOST);
    EXPECT_NE(shown.remedy, "");
  }
}

TEST_F(ShownSurfaces, OfOneThatCameTooLateThereIsNothing) {
  keep_mesh();
  const perimap_Surface& surface = made_.surface_at(kNow, 7);
  EXPECT_TRUE(gate_.show(surface, kNow + 200ms).usable());
  expect_nothing(gate_.show(surface, kNow + 201ms));
  expect_nothing(show_nothing(surface, "two publishers", ""));
}

// A model that was made before the last beat expects one by now; the surface has seen it.
TEST_F(ShownSurfaces, HaveTheMeshAtTheirOwnPhaseWhichIsNewerThanTheModels) {
  perimap_SurfaceModel& model = made_.model_at(kNow, 1);
  model.expected_until_ns = to_ns(kNow - 1ms);
  gate_.take(test::owned(model));
  gate_.take(test::owned(made_.mesh_at(kNow, 1)));
  perimap_Surface& surface = made_.surface_at(kNow, 7);
  surface.cardiac_phase_rad = 0.0;
  const ShownSurface shown = gate_.show(surface, kNow);
  EXPECT_EQ(shown.state, perimap_SURFACE_GOOD);
  ASSERT_EQ(shown.mesh.positions_W_mm.size(), 4U);
  const auto at_a_beat = MadePublication::vertex_at(1, from_ns(0) + 100s);
  EXPECT_NEAR(shown.mesh.positions_W_mm[0][2], at_a_beat[2], 1e-4);
  EXPECT_GT(std::abs(at_a_beat[2] - MadePublication::vertex_at(1, kNow)[2]), 1.0);
}

TEST_F(ShownSurfaces, HaveNoMeshOfAnotherRunOrOneThatTheClientRefuses) {
  keep_mesh();
  made_.restart();
  EXPECT_TRUE(gate_.show(made_.surface_at(kNow, 7), kNow).mesh.triangles.empty());
  gate_.take(test::owned(made_.model_at(kNow, 1)));
  EXPECT_TRUE(gate_.show(made_.surface_at(kNow, 7), kNow).mesh.triangles.empty());
  gate_.take(test::owned(made_.mesh_at(kNow, 1)));
  EXPECT_FALSE(gate_.show(made_.surface_at(kNow, 7), kNow).mesh.triangles.empty());
  perimap_SurfaceMesh& none = made_.mesh_at(kNow, 2);
  none.state = perimap_MESH_NONE;
  none.reason = perimap_MESH_REASON_ON_A_LINE;
  gate_.take(test::owned(none));
  const ShownSurface shown = gate_.show(made_.surface_at(kNow, 7), kNow);
  EXPECT_TRUE(shown.mesh.triangles.empty());
  EXPECT_EQ(shown.why_no_mesh, "the features lie on a line");
  EXPECT_EQ(shown.features.size(), 3U);
  keep_mesh();
  gate_.forget();
  EXPECT_TRUE(gate_.show(made_.surface_at(kNow, 7), kNow).mesh.triangles.empty());
}

TEST_F(ShownSurfaces, FiguresThatAreNoNumbersAreLeftOut) {
  const auto shown_with = [this](const std::function<void(perimap_Surface&)>& garble) {
    perimap_Surface& surface = made_.surface_at(kNow, 7);
    const auto covariance = std::to_array(surface.features._buffer[1].covariance_W_mm2);
    garble(surface);
    ShownSurface shown = gate_.show(surface, kNow);
    std::copy(covariance.begin(), covariance.end(), surface.features._buffer[1].covariance_W_mm2);
    return shown;
  };
  for (const double no_number : {kNone, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(shown_with([=](auto& s) { s.features._buffer[1].position_W_mm[2] = no_number; }).features.size(), 2U);
    EXPECT_EQ(shown_with([=](auto& s) { s.features._buffer[1].covariance_W_mm2[4] = no_number; }).features.size(), 2U);
    EXPECT_FALSE(shown_with([=](auto& s) { s.translation_WC_mm[0] = no_number; }).X_WC);
    EXPECT_FALSE(shown_with([=](auto& s) { s.rotation_WC_wxyz[3] = no_number; }).X_WC);
  }
  EXPECT_EQ(shown_with([](auto& s) {
              for (double& c : s.features._buffer[1].covariance_W_mm2) c = -1.0;
            }).features.size(),
            2U);
  EXPECT_FALSE(shown_with([](auto& s) { std::fill_n(s.rotation_WC_wxyz, 4, 0.0); }).X_WC);
  EXPECT_FALSE(shown_with([](auto& s) { s.camera_pose_known = false; }).X_WC);
  // Times may be anything; a sanitizer would notice a sum that is too large.
  const auto far = shown_with([](auto& s) {
    s.release_utc_ns = std::numeric_limits<std::int64_t>::max();
    s.release_time_ns = std::numeric_limits<std::int64_t>::min();
  });
  EXPECT_EQ(far.features.size(), 3U);
  EXPECT_EQ(shown_with([](auto& s) { s.release_utc_ns = 0; }).utc_minus_monotonic.count(), 0);
}

}  // namespace
}  // namespace perimap
