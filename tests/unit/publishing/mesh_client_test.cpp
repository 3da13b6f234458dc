// The header that navigation software evaluates a surface mesh with.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <functional>
#include <limits>
#include <vector>

#include "counted_allocations.hpp"
#include "made_mesh.hpp"
#include "perimap_mesh_client.hpp"

namespace perimap {
namespace {

using client::MeshRefusal;
using client::NearestPoint;
using client::PointRefusal;
using client::PredictedMesh;
using std::chrono::milliseconds;

Vector3d vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
std::array<double, 3> array(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// At an instant, as known when the model was made.
PredictedMesh predicted(test::MadeMesh& made, Duration ahead = milliseconds(80)) {
  PredictedMesh mesh;
  client::predict(made.mesh(), made.model(), to_ns(made.now() + ahead), to_ns(made.now()), {}, mesh);
  return mesh;
}

// A vertex well within: its neighbours are of the same kind.
std::uint32_t inner_vertex(const PredictedMesh& mesh) {
  Vector3d middle = Vector3d::Zero();
  for (const auto& p : mesh.positions_W_mm) middle += vector(p) / static_cast<double>(mesh.positions_W_mm.size());
  std::uint32_t best = 0;
  double least = 1e9;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) {
      const double d = (vector(mesh.positions_W_mm[v]) - middle).norm();
      if (d < least) {
        least = d;
        best = v;
      }
    }
  }
  return best;
}

TEST(MeshClient, PutsVerticesWhereTheSurfaceIs) {
  test::MadeMesh made;
  for (const int ms : {-500, 0, 80, 650}) {
    const PredictedMesh mesh = predicted(made, milliseconds(ms));
    ASSERT_EQ(mesh.refusal, MeshRefusal::kNone) << describe(mesh);
    const SurfaceMesh& of = made.made()->mesh;
    ASSERT_EQ(static_cast<Eigen::Index>(mesh.positions_W_mm.size()), of.vertices());
    ASSERT_EQ(mesh.triangles.size(), of.triangles.size());
    const PhaseEstimate phase = made.clock().at(made.now() + milliseconds(ms));
    const Basis b = basis_at(test::kLayout, phase.phase_rad);
    const Basis rate = basis_rate(test::kLayout, phase.phase_rad);
    for (Eigen::Index v = 0; v < of.vertices(); ++v) {
      const auto i = static_cast<std::size_t>(v);
      const auto c = of.coefficients_W_mm.middleRows<3>(3 * v);
      EXPECT_LT((vector(mesh.positions_W_mm[i]) - Vector3d(c * b)).norm(), 1e-4);
      EXPECT_LT((vector(mesh.velocities_W_mm_per_s[i]) - phase.rate_rad_per_s * Vector3d(c * rate)).norm(), 1e-3);
      const auto six = of.covariances_W_mm2.col(v);
      Matrix3d covariance;
      covariance << six(0), six(1), six(2), six(1), six(3), six(4), six(2), six(4), six(5);
      const double largest = Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance).eigenvalues()(2);
      EXPECT_GE(mesh.deviations_mm[i], std::sqrt(largest) - 1e-5);
      EXPECT_LT(mesh.deviations_mm[i], std::sqrt(largest) + 0.5);
    }
  }
}

// As perimapd publishes it for that instant, if it knows no more than the model does.
perimap_Surface surface_at(test::MadeMesh& made, Duration ahead) {
  const perimap_SurfaceModel& model = made.model();
  perimap_Surface surface{};
  std::copy(std::begin(model.source), std::end(model.source), surface.source);
  std::copy(std::begin(model.run_id), std::end(model.run_id), surface.run_id);
  surface.state = perimap_SURFACE_GOOD;
  surface.valid_time_ns = to_ns(made.now() + ahead);
  surface.valid_until_ns = surface.valid_time_ns + 200'000'000;
  const PhaseEstimate phase = made.clock().at(made.now() + ahead);
  surface.cardiac_phase_rad = phase.phase_rad;
  surface.cardiac_phase_rate_rad_per_s = phase.rate_rad_per_s;
  return surface;
}

TEST(MeshClient, MovesTheMeshByASurfacesOwnPhaseAndIsWorthWhatThatIs) {
  test::MadeMesh made;
  const PredictedMesh by_model = predicted(made);
  perimap_Surface surface = surface_at(made, milliseconds(80));
  perimap_SurfaceModel model = made.model();
  model.expected_until_ns = to_ns(made.now());  // it expects a beat that the surface knows of
  PredictedMesh mesh;
  const auto predict = [&] { return client::predict(made.mesh(), model, surface, to_ns(made.now()), {true}, mesh); };
  ASSERT_TRUE(predict()) << describe(mesh);
  EXPECT_EQ(mesh.state, perimap_SURFACE_GOOD);
  ASSERT_EQ(mesh.positions_W_mm.size(), by_model.positions_W_mm.size());
  for (std::size_t v = 0; v < mesh.positions_W_mm.size(); ++v) {
    EXPECT_LT((vector(mesh.positions_W_mm[v]) - vector(by_model.positions_W_mm[v])).norm(), 1e-4);
    EXPECT_LT((vector(mesh.normals_W[v]) - vector(by_model.normals_W[v])).norm(), 1e-4);
  }
  surface.cardiac_phase_rad += 1.0;
  surface.state = perimap_SURFACE_DEGRADED;
  surface.reason = perimap_SURFACE_REASON_POSE_MISSING;
  ASSERT_TRUE(predict());
  EXPECT_EQ(mesh.state, perimap_SURFACE_DEGRADED);
  EXPECT_EQ(mesh.reason, perimap_SURFACE_REASON_POSE_MISSING);
  const std::uint32_t v = inner_vertex(mesh);
  EXPECT_GT((vector(mesh.positions_W_mm[v]) - vector(by_model.positions_W_mm[v])).norm(), 0.1);
}

TEST(MeshClient, IsRefusedWithTheSurfaceThatItIsShownWith) {
  test::MadeMesh made;
  struct Row {
    std::function<void(perimap_Surface&)> change;
    MeshRefusal refusal;
    client::Refusal of_surface;
  };
  const double no_number = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Row> rows = {
      {[](auto& s) { s.state = perimap_SURFACE_INVALID; }, MeshRefusal::kModel, client::Refusal::kInvalid},
      {[](auto& s) { s.state = static_cast<perimap_SurfaceState>(3); }, MeshRefusal::kModel, client::Refusal::kInvalid},
      {[](auto& s) { s.state = perimap_SURFACE_DEGRADED; }, MeshRefusal::kModel, client::Refusal::kDegraded},
      {[](auto& s) { s.valid_until_ns = 0; }, MeshRefusal::kModel, client::Refusal::kStale},
      {[](auto& s) { s.source[0] ^= 1; }, MeshRefusal::kOtherSource, client::Refusal::kNone},
      {[](auto& s) { s.run_id[3] ^= 1; }, MeshRefusal::kOtherSource, client::Refusal::kNone},
      {[](auto& s) { s.valid_time_ns += 60'000'000'000; }, MeshRefusal::kStale, client::Refusal::kNone},
      {[=](auto& s) { s.cardiac_phase_rad = no_number; }, MeshRefusal::kMalformed, client::Refusal::kNone},
      {[=](auto& s) { s.cardiac_phase_rate_rad_per_s = no_number; }, MeshRefusal::kMalformed, client::Refusal::kNone},
      {[](auto& s) { s.cardiac_phase_deviation_rad = -1.0; }, MeshRefusal::kMalformed, client::Refusal::kNone},
  };
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SCOPED_TRACE(i);
    perimap_Surface surface = surface_at(made, milliseconds(80));
    rows[i].change(surface);
    PredictedMesh mesh;
    EXPECT_FALSE(client::predict(made.mesh(), made.model(), surface, to_ns(made.now()), {}, mesh));
    EXPECT_EQ(mesh.refusal, rows[i].refusal);
    EXPECT_EQ(mesh.model_refusal, rows[i].of_surface);
    EXPECT_TRUE(mesh.positions_W_mm.empty());
    EXPECT_TRUE(mesh.triangles.empty());
  }
}

TEST(MeshClient, TurnsNormalsToWhereTheCameraWas) {
  test::MadeMesh made;
  const PredictedMesh mesh = predicted(made);
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) {
      EXPECT_NEAR(vector(mesh.normals_W[v]).norm(), 1.0, 1e-9);
      EXPECT_LT(vector(mesh.normals_W[v]).dot(vector(mesh.positions_W_mm[v])), 0.0);
    }
  }
}

TEST(MeshClient, TellsTheSignedDistanceOfAPoint) {
  test::MadeMesh made(2000);
  const PredictedMesh mesh = predicted(made);
  const std::uint32_t v = inner_vertex(mesh);
  const Vector3d p = vector(mesh.positions_W_mm[v]);
  const Vector3d n = vector(mesh.normals_W[v]);
  for (const double distance_mm : {-4.0, -0.2, 0.2, 4.0, 30.0}) {
    SCOPED_TRACE(distance_mm);
    const NearestPoint at = client::nearest(mesh, array(p + distance_mm * n), array(-7.0 * n));
    ASSERT_EQ(at.refusal, PointRefusal::kNone) << describe(at);
    EXPECT_NEAR(at.distance_mm, distance_mm, 0.01 + 0.02 * std::abs(distance_mm));
    EXPECT_GT(vector(at.normal_W).dot(n), 0.99);
    EXPECT_GT(at.deviation_mm, 0.01);
    EXPECT_LT(at.deviation_mm, mesh.deviations_mm[v] + 0.1);
    EXPECT_NEAR(at.approach_mm_per_s, -7.0 - vector(mesh.velocities_W_mm_per_s[v]).dot(n), 1.0);
  }
}

TEST(MeshClient, FindsTheNearestPointOfAnyTriangle) {
  const Vector3d a(0, 0, 0), b(4, 0, 0), c(1, 3, 0);
  std::mt19937_64 random(62);
  std::uniform_real_distribution<double> uniform(-6.0, 8.0);
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d p(uniform(random), uniform(random), uniform(random));
    const auto shares = client::detail::nearest_of_triangle(array(p), array(a), array(b), array(c));
    EXPECT_NEAR(shares[0] + shares[1] + shares[2], 1.0, 1e-12);
    const double found = (shares[0] * a + shares[1] * b + shares[2] * c - p).norm();
    for (int i = 0; i <= 40; ++i) {
      for (int j = 0; i + j <= 40; ++j) {
        EXPECT_GE((a + (b - a) * i / 40.0 + (c - a) * j / 40.0 - p).norm(), found - 1e-9);
      }
    }
  }
}

TEST(MeshClient, SaysNothingOfAPointBesideWhatIsKnown) {
  test::MadeMesh made(1500, 24.0);
  const PredictedMesh mesh = predicted(made);
  ASSERT_EQ(mesh.refusal, MeshRefusal::kNone);
  // Far to the side, and before the hole.
  for (const Vector3d& p : {Vector3d(90, 0, 100), Vector3d(0, 0, 80), Vector3d(0, 0, 95)}) {
    const NearestPoint at = client::nearest(mesh, array(p));
    EXPECT_EQ(at.refusal, PointRefusal::kBeyondEdge) << p.transpose();
    EXPECT_STREQ(describe(at), "beside what is known of the surface");
  }
  // Over its ring.
  EXPECT_EQ(client::nearest(mesh, array(test::MadeOrgan::mean_place({30, 0}) * 0.9)).refusal, PointRefusal::kNone);
}

TEST(MeshClient, RefusesAPointThatIsNoNumber) {
  test::MadeMesh made;
  const PredictedMesh mesh = predicted(made);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(client::nearest(mesh, {0, nan, 90}).refusal, PointRefusal::kNotANumber);
  EXPECT_EQ(client::nearest(mesh, {0, 0, 90}, {nan, 0, 0}).refusal, PointRefusal::kNotANumber);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(client::nearest(mesh, {infinity, 0, 90}).refusal, PointRefusal::kNotANumber);
}

TEST(MeshClient, RefusesWhatIsTooOld) {
  test::MadeMesh made;
  perimap_SurfaceMesh mesh = made.mesh();
  perimap_SurfaceModel model = made.model();
  model.valid_until_ns = model.expected_until_ns = std::numeric_limits<std::int64_t>::max();
  PredictedMesh out;
  const std::int64_t now = to_ns(made.now());
  ASSERT_TRUE(client::predict(mesh, model, now, now, {}, out));
  EXPECT_FALSE(client::predict(mesh, model, now, mesh.valid_until_ns + 1, {}, out));
  EXPECT_EQ(out.refusal, MeshRefusal::kStale);
  EXPECT_STREQ(describe(out), "the surface is too old");
  EXPECT_TRUE(out.positions_W_mm.empty());
  EXPECT_TRUE(out.triangles.empty());
  EXPECT_EQ(client::nearest(out, {0, 0, 90}).refusal, PointRefusal::kNoMesh);
  EXPECT_TRUE(client::predict(mesh, model, now, mesh.valid_until_ns, {}, out));
  EXPECT_FALSE(out.triangles.empty());
}

TEST(MeshClient, RefusesWithTheModel) {
  test::MadeMesh made;
  perimap_SurfaceModel model = made.model();
  PredictedMesh out;
  const std::int64_t now = to_ns(made.now());
  EXPECT_FALSE(client::predict(made.mesh(), model, now, model.valid_until_ns + 1, {}, out));
  EXPECT_EQ(out.refusal, MeshRefusal::kModel);
  EXPECT_EQ(out.model_refusal, client::Refusal::kStale);
  EXPECT_STREQ(describe(out), "perimapd is not heard any more");
  model.state = perimap_SURFACE_DEGRADED;
  model.reason = perimap_SURFACE_REASON_NOT_SEEN;
  EXPECT_FALSE(client::predict(made.mesh(), model, now, now, {}, out));
  EXPECT_STREQ(describe(out), "the images do not show what is mapped");
  EXPECT_TRUE(client::predict(made.mesh(), model, now, now, {.degraded = true}, out));
  EXPECT_STREQ(describe(out), "the images do not show what is mapped");
}

TEST(MeshClient, RefusesAnotherSourceAndAnotherLaw) {
  test::MadeMesh made;
  test::MadeMesh other(400, 0.0, "theatre 4");
  PredictedMesh out;
  const std::int64_t now = to_ns(made.now());
  EXPECT_FALSE(client::predict(other.mesh(), made.model(), now, now, {}, out));
  EXPECT_EQ(out.refusal, MeshRefusal::kOtherSource);
  perimap_SurfaceMesh mesh = made.mesh();
  mesh.phase_law = static_cast<std::uint8_t>(perimap_PHASE_LAW_WARPED);
  EXPECT_FALSE(client::predict(mesh, made.model(), now, now, {}, out));
  EXPECT_EQ(out.refusal, MeshRefusal::kOtherLaw);
}

TEST(MeshClient, RefusesNumbersThatPerimapdDoesNotSend) {
  test::MadeMesh made;
  const perimap_SurfaceMesh good = made.mesh();
  std::vector<float> coefficients(good.coefficients_W_mm._buffer,
                                  good.coefficients_W_mm._buffer + good.coefficients_W_mm._length);
  std::vector<float> covariances(good.covariances_W_mm2._buffer,
                                 good.covariances_W_mm2._buffer + good.covariances_W_mm2._length);
  std::vector<std::uint32_t> triangles(good.triangles._buffer, good.triangles._buffer + good.triangles._length);
  std::vector<std::uint8_t> states(good.vertex_states._buffer, good.vertex_states._buffer + good.vertex_states._length);
  const auto garbled = [&](const char* what, const std::function<void(perimap_SurfaceMesh&)>& change) {
    SCOPED_TRACE(what);
    auto c = coefficients;
    auto p = covariances;
    auto t = triangles;
    auto s = states;
    perimap_SurfaceMesh mesh = good;
    mesh.coefficients_W_mm._buffer = c.data();
    mesh.covariances_W_mm2._buffer = p.data();
    mesh.triangles._buffer = t.data();
    mesh.vertex_states._buffer = s.data();
    change(mesh);
    // One that is kept and one that is new.
    PredictedMesh kept = predicted(made);
    for (PredictedMesh fresh; PredictedMesh * out : {&kept, &fresh}) {
      mesh.sample_sequence = good.sample_sequence + 1;
      EXPECT_FALSE(client::predict(mesh, made.model(), to_ns(made.now()), to_ns(made.now()), {}, *out));
      EXPECT_EQ(out->refusal, MeshRefusal::kMalformed);
      EXPECT_TRUE(out->positions_W_mm.empty());
    }
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  garbled("a state that is not known", [](auto& mesh) { mesh.state = 9; });
  garbled("no vertices", [](auto& mesh) { mesh.vertex_states._length = 0; });
  garbled("too few coefficients", [](auto& mesh) { --mesh.coefficients_W_mm._length; });
  garbled("too many coefficients", [](auto& mesh) { mesh.cardiac_harmonics = 3; });
  garbled("harmonics beyond reason", [](auto& mesh) { mesh.cardiac_harmonics = 0xffffffffU; });
  garbled("breathing that the model does not have", [](auto& mesh) { mesh.respiratory_harmonics = 2; });
  garbled("too few covariances", [](auto& mesh) { mesh.covariances_W_mm2._length -= 6; });
  garbled("a coefficient that is no number", [&](auto& mesh) { mesh.coefficients_W_mm._buffer[100] = nan; });
  garbled("a covariance that is no number", [&](auto& mesh) { mesh.covariances_W_mm2._buffer[100] = nan; });
  garbled("a negative variance", [](auto& mesh) {
    for (std::uint32_t i = 0; i < mesh.covariances_W_mm2._length; ++i) mesh.covariances_W_mm2._buffer[i] = -1.0F;
  });
  garbled("no triangles", [](auto& mesh) { mesh.triangles._length = 0; });
  garbled("a triangle of two corners", [](auto& mesh) { --mesh.triangles._length; });
  garbled("a corner that is no vertex", [](auto& mesh) { mesh.triangles._buffer[5] = mesh.vertex_states._length; });
  garbled("a triangle that is not supported",
          [](auto& mesh) { mesh.vertex_states._buffer[mesh.triangles._buffer[5]] = perimap_VERTEX_UNCERTAIN; });
}

// Whoever repeats a run and a number with another sample is not trusted with lengths that are kept.
TEST(MeshClient, ASampleThatRepeatsANumberIsNotReadBeyondItsEnd) {
  test::MadeMesh made;
  const auto refused = [&](const std::function<void(perimap_SurfaceMesh&)>& change) {
    PredictedMesh kept = predicted(made);
    perimap_SurfaceMesh mesh = made.mesh();
    change(mesh);
    return !client::predict(mesh, made.model(), to_ns(made.now()), to_ns(made.now()), {}, kept) &&
           kept.refusal == MeshRefusal::kMalformed;
  };
  EXPECT_FALSE(refused([](auto&) {}));
  EXPECT_TRUE(refused([](auto& mesh) {
    mesh.coefficients_W_mm._buffer = nullptr;
    mesh.coefficients_W_mm._length = 0;
  }));
  EXPECT_TRUE(refused([](auto& mesh) { --mesh.covariances_W_mm2._length; }));
  EXPECT_TRUE(refused([](auto& mesh) { mesh.triangles._length = 0; }));
  perimap_SurfaceModel model = made.model();
  perimap_SurfaceMesh mesh = made.mesh();
  model.cardiac_harmonics = mesh.cardiac_harmonics = 300;
  PredictedMesh kept = predicted(made);
  EXPECT_FALSE(client::predict(mesh, model, to_ns(made.now()), to_ns(made.now()), {}, kept));
}

TEST(MeshClient, AFigureOfTheModelThatIsNoNumberIsNoDeviation) {
  test::MadeMesh made;
  const auto told = [&](const std::function<void(perimap_SurfaceModel&)>& change) {
    perimap_SurfaceModel model = made.model();
    change(model);
    PredictedMesh out;
    return client::predict(made.mesh(), model, to_ns(made.now()), to_ns(made.now()), {}, out);
  };
  EXPECT_TRUE(told([](auto&) {}));
  EXPECT_FALSE(
      told([](auto& model) { model.respiratory_clock.deviation_mm = std::numeric_limits<double>::quiet_NaN(); }));
}

TEST(MeshClient, TakesNoMemoryAfterTheFirst) {
  test::MadeMesh made(2000);
  const perimap_SurfaceMesh& mesh = made.mesh();
  const perimap_SurfaceModel& model = made.model();
  PredictedMesh out;
  ASSERT_TRUE(client::predict(mesh, model, to_ns(made.now()), to_ns(made.now()), {}, out));
  perimap_SurfaceMesh next = mesh;
  double sum = 0.0;
  const long taken = test::allocations_of([&] {
    for (int i = 0; i < 10; ++i) {
      ++next.sample_sequence;  // another mesh of this size
      client::predict(next, model, to_ns(made.now()) + i * 1000000, to_ns(made.now()), {}, out);
      sum += client::nearest(out, {1.0, 2.0, 80.0}).distance_mm;
      client::predict(next, model, to_ns(made.now()), next.valid_until_ns + 1, {}, out);  // refused in between
    }
  });
  EXPECT_EQ(taken, 0);
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace perimap
