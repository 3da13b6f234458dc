#include "drivers/standins/truth/organ_motion.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>

#include "drivers/standins/truth/drift.hpp"
#include "drivers/standins/truth/ground_truth.hpp"
#include "drivers/standins/truth/truth_messages.hpp"

namespace perimap {
namespace {

using std::chrono::seconds;

Instant at(int s) { return Instant(seconds(s)); }

OrganMove move(OrganMove::Kind kind, int begin_s, int end_s) {
  OrganMove m;
  m.kind = kind;
  m.begin = at(begin_s);
  m.end = at(end_s);
  return m;
}

OrganMotion motion(std::vector<OrganMove> moves) {
  auto made = OrganMotion::create(std::move(moves));
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return made ? *made : OrganMotion();
}

TEST(OrganMotion, AMovedOrganGoesFromWhereTheLastMoveLeftItAndStays) {
  OrganMove away = move(OrganMove::Kind::kRetraction, 10, 20), back = move(OrganMove::Kind::kRetraction, 30, 32);
  away.translation_mm = {6.0, 0.0, 0.0};
  const OrganMotion organ = motion({away, back});
  const Vector3d p(1.0, 2.0, 3.0);
  const auto x = [&](int s) { return organ.at(at(s)).of(p, p).x(); };
  EXPECT_EQ(x(5), 1.0);
  EXPECT_NEAR(x(15), 4.0, 1e-12);
  EXPECT_NEAR(x(25), 7.0, 1e-12);
  EXPECT_NEAR(x(31), 4.0, 1e-12);
  EXPECT_NEAR(x(40), 1.0, 1e-12);
}

TEST(OrganMotion, TurnsAndStretchesAboutThePivotTheInnermostFirst) {
  OrganMove gas = move(OrganMove::Kind::kInsufflation, 0, 1), tilt = move(OrganMove::Kind::kTilt, 0, 1);
  gas.stretch = 0.1;
  gas.pivot_mm = {10.0, 0.0, 0.0};
  tilt.rotation_rad = {0.0, 0.0, 1.5707963267948966};
  const OrganMotion organ = motion({gas, tilt});
  // (20, 0, 0) is stretched to (21, 0, 0), then turned to (0, 21, 0).
  EXPECT_NEAR((organ.at(at(2)).of({20.0, 0.0, 0.0}, {20.0, 0.0, 0.0}) - Vector3d(0.0, 21.0, 0.0)).norm(), 0.0, 1e-9);
}

TEST(OrganMotion, ADentMovesItsMiddleMostWhatLiesBeyondItNotAtAllAndGoesAgain) {
  OrganMove dent = move(OrganMove::Kind::kDent, 10, 14);
  dent.translation_mm = {0.0, 0.0, 5.0};
  dent.radius_mm = 10.0;
  const OrganMotion organ = motion({dent});
  const auto depth = [&](int s, const Vector3d& rest) {
    return organ.at(at(s)).of(rest + Vector3d(0, 0, 1), rest).z() - 1;
  };
  EXPECT_NEAR(depth(12, Vector3d::Zero()), 5.0, 1e-12);
  EXPECT_NEAR(depth(12, {5.0, 0.0, 0.0}), 5.0 * 0.5625, 1e-12);
  EXPECT_EQ(depth(12, {10.0, 0.0, 0.0}), 0.0);
  EXPECT_EQ(depth(14, Vector3d::Zero()), 0.0);
  EXPECT_EQ(depth(9, Vector3d::Zero()), 0.0);
}

TEST(OrganMotion, RefusesWhatIsNoMotion) {
  const auto refused = [](std::vector<OrganMove> moves) { return !OrganMotion::create(std::move(moves)).has_value(); };
  const OrganMove good = move(OrganMove::Kind::kTilt, 1, 2);
  EXPECT_FALSE(refused({good, move(OrganMove::Kind::kTilt, 2, 3)}));
  EXPECT_FALSE(refused({good, move(OrganMove::Kind::kRetraction, 1, 3)}));
  EXPECT_TRUE(refused({move(OrganMove::Kind::kTilt, 2, 2)}));
  EXPECT_TRUE(refused({good, move(OrganMove::Kind::kTilt, 1, 3)})) << "overlaps";
  EXPECT_TRUE(refused({good, move(OrganMove::Kind::kRetraction, 0, 1)})) << "not in order";
  EXPECT_TRUE(refused({move(OrganMove::Kind::kDent, 1, 2)})) << "no radius";
  OrganMove wrong = good;
  wrong.translation_mm.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused({wrong}));
  wrong = good;
  wrong.stretch = -1.0;
  EXPECT_TRUE(refused({wrong}));
  wrong = good;
  wrong.kind = static_cast<OrganMove::Kind>(9);
  EXPECT_TRUE(refused({wrong}));
}

GroundTruth one_triangle() {
  HeartMesh mesh;
  mesh.vertex_count = 3;
  mesh.coefficients_mm = {-500, -500, 100, 500, -500, 100, 0, 500, 100};
  mesh.triangles = {0, 2, 1};
  HeartMotion heart;
  for (int i = 0; i < 40; ++i) heart.r_peaks.push_back(at(i));
  auto truth = GroundTruth::create(mesh, heart);
  EXPECT_TRUE(truth.has_value());
  return *std::move(truth);
}

TEST(RecordedOrganMotion, IsReadBackAsItWasRecorded) {
  OrganMove away = move(OrganMove::Kind::kRetraction, 5, 7), dent = move(OrganMove::Kind::kDent, 6, 9);
  away.translation_mm = {6.0, -1.0, 2.0};
  away.rotation_rad = {0.01, 0.02, -0.03};
  away.pivot_mm = {1.0, 2.0, 3.0};
  dent.translation_mm = {0.0, 0.0, 4.0};
  dent.pivot_mm = {0.0, 0.0, 100.0};
  dent.radius_mm = 300.0;
  OrganMove gas = move(OrganMove::Kind::kInsufflation, 8, 9);
  gas.stretch = 0.02;
  GroundTruth recorded = one_triangle(), read = one_triangle();
  recorded.set_procedure(motion({away, dent, gas}), {{at(3), at(4), std::chrono::milliseconds(20)}});
  ProcedureBuffers buffers;
  ASSERT_TRUE(set_procedure(borrow_truth_procedure(recorded, buffers), read));
  for (const int s : {1, 6, 7, 8, 20}) {
    const SurfacePoint point{0, {0.2, 0.3, 0.5}};
    EXPECT_EQ(read.position(point, at(s)), recorded.position(point, at(s))) << s;
    EXPECT_EQ(read.taken_at(at(s)), recorded.taken_at(at(s))) << s;
  }
  EXPECT_NE(read.position({0, {0.2, 0.3, 0.5}}, at(8)), one_triangle().position({0, {0.2, 0.3, 0.5}}, at(8)));
}

TEST(RecordedOrganMotion, IsRefusedWhereItIsNone) {
  perimap_TruthOrganMove moves[2] = {};
  moves[0].begin_time_ns = moves[1].begin_time_ns = 1;
  moves[0].end_time_ns = moves[1].end_time_ns = 5;
  moves[0].kind = moves[1].kind = 2;
  perimap_TruthDelay delays[2] = {{1, 5, 1000}, {4, 8, 0}};
  const auto error_of = [&](std::uint32_t move_count, std::uint32_t delay_count) {
    perimap_TruthProcedure message{};
    message.organ_moves = {move_count, move_count, moves, false};
    message.camera_delays = {delay_count, delay_count, delays, false};
    GroundTruth truth = one_triangle();
    const auto result = set_procedure(message, truth);
    return result ? std::string("accepted") : result.error().message;
  };
  EXPECT_EQ(error_of(1, 1), "accepted");
  EXPECT_EQ(error_of(2, 1), "organ motion: move 1 begins before the last of its kind has ended");
  EXPECT_EQ(error_of(1, 2), "camera delay 1: it is not in order, or more than a second");
  delays[0].to_ns = 2'000'000'000;
  EXPECT_EQ(error_of(1, 1), "camera delay 0: it is not in order, or more than a second");
  moves[0].kind = 4;
  EXPECT_EQ(error_of(1, 0), "organ motion: move 0 is of no kind");
}

TEST(Drift, GoesEvenlyFromWhereTheLastLeftIt) {
  const std::vector<Drift> drifts = {{at(10), at(20), std::chrono::milliseconds(40)}, {at(30), at(40), Duration(0)}};
  EXPECT_EQ(drifted(drifts, at(5)), Duration(0));
  EXPECT_NEAR(to_seconds(drifted(drifts, at(15))), 0.020, 1e-9);
  EXPECT_NEAR(to_seconds(drifted(drifts, at(25))), 0.040, 1e-9);
  EXPECT_NEAR(to_seconds(drifted(drifts, at(35))), 0.020, 1e-9);
  EXPECT_EQ(drifted({}, at(5)), Duration(0));
}

}  // namespace
}  // namespace perimap
