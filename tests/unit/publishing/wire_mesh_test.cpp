#include "daemon/publishing/wire_mesh.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "drivers/recording/cdr.hpp"
#include "made_mesh.hpp"

namespace perimap {
namespace {

using std::chrono::seconds;

constexpr Instant kCapture(seconds(20));

std::vector<SurfaceEvidence> features(std::size_t count, double apart_mm = 3.5) {
  std::mt19937_64 random(71);
  return test::evidence_on(test::places_on_disc(count, 40.0, apart_mm, random), 0.1, random);
}

WireMesh wire_mesh() {
  Identity identity{"theatre 3", ReleaseStream::kFrame, "tracker"};
  identity.run_id[0] = 9;
  return WireMesh(identity);
}

TEST(WireMesh, CarriesTheMeshAndWhatItIsWorth) {
  test::ServedMaker maker(500);
  maker.make(features(60), kCapture, PhaseLaw::kWarped);
  WireMesh wire = wire_mesh();
  const perimap_SurfaceMesh* mesh = wire.news(*maker, kCapture + seconds(1), seconds(1000));
  ASSERT_NE(mesh, nullptr);
  EXPECT_STREQ(mesh->source, "theatre 3");
  EXPECT_STREQ(mesh->frame_id, "tracker");
  EXPECT_EQ(mesh->run_id[0], 9);
  EXPECT_EQ(mesh->sample_sequence, 1U);
  EXPECT_EQ(mesh->state, perimap_MESH_THERE);
  EXPECT_EQ(mesh->time_ns, to_ns(kCapture));
  EXPECT_EQ(mesh->time_utc_ns, to_ns(kCapture) + 1000'000'000'000);
  EXPECT_EQ(mesh->valid_until_ns, to_ns(kCapture) + 5'000'000'000);
  EXPECT_EQ(mesh->frame_sequence, 77U);
  EXPECT_EQ(mesh->phase_law, perimap_PHASE_LAW_WARPED);
  EXPECT_EQ(mesh->cardiac_harmonics, 4U);
  EXPECT_EQ(mesh->respiratory_harmonics, 0U);
  EXPECT_EQ(mesh->features, 60U);
  const auto made = maker->newest();
  const std::uint32_t V = mesh->vertex_states._length;
  ASSERT_EQ(V, made->mesh.vertices());
  ASSERT_EQ(mesh->coefficients_W_mm._length, 27 * V);
  ASSERT_EQ(mesh->covariances_W_mm2._length, 6 * V);
  ASSERT_EQ(mesh->triangles._length, 3 * made->mesh.triangles.size());
  // Of vertex 5, the fourth coefficient of y; and of its covariance, yz.
  EXPECT_EQ(mesh->coefficients_W_mm._buffer[(9 + 3) * V + 5],
            static_cast<float>(made->mesh.coefficients_W_mm(3 * 5 + 1, 3)));
  EXPECT_EQ(mesh->covariances_W_mm2._buffer[4 * V + 5], static_cast<float>(made->mesh.covariances_W_mm2(4, 5)));
  EXPECT_EQ(mesh->leave_one_out_rms_mm, made->surface->agreement().rms_mm);
}

TEST(WireMesh, TellsEachSurfaceOnce) {
  test::ServedMaker maker(500);
  WireMesh wire = wire_mesh();
  const perimap_SurfaceMesh* mesh = wire.news(*maker, kCapture, seconds(0));
  ASSERT_NE(mesh, nullptr);
  EXPECT_EQ(mesh->state, perimap_MESH_NONE);
  EXPECT_EQ(mesh->reason, perimap_MESH_REASON_NOT_YET);
  EXPECT_EQ(wire.news(*maker, kCapture, seconds(0)), nullptr);
  maker.make(features(60), kCapture);
  ASSERT_NE(mesh = wire.news(*maker, kCapture, seconds(0)), nullptr);
  EXPECT_EQ(mesh->state, perimap_MESH_THERE);
  EXPECT_EQ(mesh->sample_sequence, 2U);
  EXPECT_EQ(wire.news(*maker, kCapture, seconds(0)), nullptr);
}

TEST(WireMesh, TakesBackWhatTheMapDoesNotHoldAnyMore) {
  test::ServedMaker maker(500);
  maker.make(features(60), kCapture);
  WireMesh wire = wire_mesh();
  ASSERT_NE(wire.news(*maker, kCapture, seconds(0)), nullptr);
  maker->withdraw();
  const perimap_SurfaceMesh* mesh = wire.news(*maker, kCapture + seconds(2), seconds(0));
  ASSERT_NE(mesh, nullptr);
  EXPECT_EQ(mesh->state, perimap_MESH_NONE);
  EXPECT_EQ(mesh->reason, perimap_MESH_REASON_MAP_CHANGED);
  EXPECT_EQ(mesh->vertex_states._length + mesh->coefficients_W_mm._length + mesh->triangles._length, 0U);
  EXPECT_EQ(mesh->time_ns, to_ns(kCapture + seconds(2)));
  maker.make(features(60), kCapture + seconds(3));
  ASSERT_NE(mesh = wire.news(*maker, kCapture, seconds(0)), nullptr);
  EXPECT_EQ(mesh->state, perimap_MESH_THERE);
}

TEST(WireMesh, SaysWhyThereIsNone) {
  test::ServedMaker maker(500);
  WireMesh wire = wire_mesh();
  const auto reason_of = [&](const std::vector<SurfaceEvidence>& evidence) {
    maker.make(evidence, kCapture);
    const perimap_SurfaceMesh* mesh = wire.news(*maker, kCapture, seconds(0));
    EXPECT_NE(mesh, nullptr);
    EXPECT_EQ(mesh->state, perimap_MESH_NONE);
    EXPECT_EQ(mesh->triangles._length, 0U);
    return mesh->reason;
  };
  EXPECT_EQ(reason_of(features(7)), perimap_MESH_REASON_TOO_FEW_FEATURES);
  EXPECT_EQ(reason_of({}), perimap_MESH_REASON_TOO_FEW_FEATURES);
  std::mt19937_64 random(72);
  std::vector<Vector2d> line;
  for (int i = 0; i < 20; ++i) line.emplace_back(4.0 * i - 40.0, 0.02 * (i % 2));
  EXPECT_EQ(reason_of(test::evidence_on(line, 0.01, random)), perimap_MESH_REASON_ON_A_LINE);
  auto broken = features(20);
  broken[3].x(2) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(reason_of(broken), perimap_MESH_REASON_UNUSABLE);
  auto behind = features(20);
  for (int axis = 0; axis < 3; ++axis) behind[3].x(axis * test::kLayout.size()) *= -1.0;
  EXPECT_EQ(reason_of(behind), perimap_MESH_REASON_UNUSABLE);
  auto uncertain = features(20);
  for (SurfaceEvidence& feature : uncertain) {
    feature.mean_mm2 *= 1e4;
    for (Matrix3d& band : feature.bands_mm2) band *= 1e4;
  }
  EXPECT_EQ(reason_of(uncertain), perimap_MESH_REASON_NOTHING_SUPPORTED);
}

// A tetrahedron before the features, and one where they are not.
std::shared_ptr<const OrganModel> model_at(const Vector3d& place_mm) {
  auto model = std::make_shared<OrganModel>();
  model->mesh_W = {{place_mm, place_mm + Vector3d(0, 6, 0), place_mm + Vector3d(6, 0, 0), place_mm + Vector3d(2, 2, 4)},
                   {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
  model->normals_W = vertex_normals(model->mesh_W);
  return model;
}

TEST(WireMesh, OfAModelHasAllVerticesOfItAndSaysWhereItLiesElsewhere) {
  test::ServedMaker on_it(500, model_at(test::MadeOrgan::mean_place({-2.0, -2.0})));
  WireMesh wire = wire_mesh();
  on_it.make(features(60), kCapture);
  const perimap_SurfaceMesh* mesh = wire.news(*on_it, kCapture, seconds(0));
  ASSERT_NE(mesh, nullptr);
  EXPECT_EQ(mesh->state, perimap_MESH_THERE);
  EXPECT_EQ(mesh->vertex_states._length, 4U);
  EXPECT_GE(mesh->triangles._length, 3U);

  test::ServedMaker elsewhere(500, model_at({0.0, 0.0, 500.0}));
  WireMesh other = wire_mesh();
  elsewhere.make(features(60), kCapture);
  mesh = other.news(*elsewhere, kCapture, seconds(0));
  ASSERT_NE(mesh, nullptr);
  EXPECT_EQ(mesh->state, perimap_MESH_NONE);
  EXPECT_EQ(mesh->reason, perimap_MESH_REASON_NOT_THE_MODEL);
}

TEST(WireMesh, IsReadByThoseWhoKnowXcdr1Alone) {
  // Cyclone restricts a type that needs XCDR2 in its descriptor.
  EXPECT_EQ(perimap_SurfaceMesh_desc.m_flagset & DDS_TOPIC_RESTRICT_DATA_REPRESENTATION, 0U);
  test::ServedMaker maker(500);
  maker.make(features(60), kCapture);
  WireMesh wire = wire_mesh();
  const perimap_SurfaceMesh& mesh = *wire.news(*maker, kCapture, seconds(0));
  CdrSerializer serializer;
  const auto bytes = serializer.serialize(mesh);
  ASSERT_TRUE(bytes.has_value());
  const auto back = deserialize<perimap_SurfaceMesh>(*bytes);
  ASSERT_TRUE(back.has_value()) << back.error().message;
  EXPECT_EQ((*back)->triangles._length, mesh.triangles._length);
  EXPECT_EQ((*back)->coefficients_W_mm._buffer[100], mesh.coefficients_W_mm._buffer[100]);
}

}  // namespace
}  // namespace perimap
