#include "core/surface/surface_start.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/surface/surface_prior.hpp"
#include "made_organ.hpp"

namespace perimap {
namespace {

using test::kLayout;
using test::MadeOrgan;

const PixelModel kModel{CameraModel{.width = 640, .height = 480, .fx = 500.0, .fy = 500.0, .cx = 320.0, .cy = 240.0}};
constexpr double kPixelDeviation = 0.7;

PeriodicSurface surface_of_sixty(std::mt19937_64& random) {
  const auto evidence = test::evidence_on(test::places_on_disc(60, 35.0, 4.0, random), 0.1, random);
  auto surface = PeriodicSurface::fit(kLayout, evidence, Vector3d::Zero());
  EXPECT_TRUE(surface.has_value());
  return *std::move(surface);
}

// Matches at 30 frames/s of what moves as `coefficients` (3 x basis), from a camera that sways by 8 mm.
std::vector<Observation> matches_of(const Eigen::Matrix3Xd& coefficients, int count, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<Observation> matches;
  for (int k = 0; k < count; ++k) {
    Observation match;
    const double t_s = k / 30.0;
    match.X_CW.t = -Vector3d(8.0 * std::sin(1.5 * t_s), 8.0 * std::cos(1.1 * t_s), 0.0);
    match.b = basis_at(kLayout, 2.0 * std::numbers::pi * 1.2 * t_s + 0.4);
    match.R = kPixelDeviation * kPixelDeviation * Matrix2d::Identity();
    EXPECT_EQ(kModel.predict(match.X_CW * Vector3d(coefficients * match.b), match.z), ProjectionStatus::kOk);
    match.z += kPixelDeviation * Vector2d(normal(random), normal(random));
    matches.push_back(match);
  }
  return matches;
}

constexpr int kPhases = 12;

struct Off {
  double rms_mm = 0.0;  // over the cycle
  double nees = 0.0;    // / 3
};

Off off(const FeatureEstimate& estimate, const Eigen::Matrix3Xd& truth) {
  Off off;
  for (int i = 0; i < kPhases; ++i) {
    const Basis b = basis_at(kLayout, 2.0 * std::numbers::pi * i / kPhases);
    const Vector3d e = estimate.position(b) - truth * b;
    off.rms_mm += e.squaredNorm() / kPhases;
    off.nees += e.dot(estimate.position_covariance(b).ldlt().solve(e)) / (3.0 * kPhases);
  }
  off.rms_mm = std::sqrt(off.rms_mm);
  return off;
}

TEST(SurfaceStart, OfASecondOfMatchesIsManyTimesAsNearAsTheirOwn) {
  std::mt19937_64 random(71);
  const PeriodicSurface surface = surface_of_sixty(random);
  double by_surface = 0.0;
  double alone = 0.0;
  double nees = 0.0;
  const auto places = test::places_on_disc(25, 30.0, 0.0, random);
  for (const Vector2d& place : places) {
    const Eigen::Matrix3Xd truth = MadeOrgan::coefficients(place);
    const std::vector<Observation> matches = matches_of(truth, 30, random);
    const SurfaceStart start = start_on_surface(surface, std::span(matches), kModel);
    ASSERT_EQ(start.kind, SurfaceStartKind::kStarted);
    const Off there = off(start.outcome.estimate, truth);
    by_surface += there.rms_mm;
    nees += there.nees / static_cast<double>(places.size());
    const BatchOutcome own = batch_start(std::span<const Observation>(matches), kModel, kLayout, Prior{});
    ASSERT_TRUE(own.ok());
    alone += off(own.estimate, truth).rms_mm;
  }
  EXPECT_LT(by_surface, 0.2 * alone);
  EXPECT_LT(by_surface / static_cast<double>(places.size()), 0.3) << "mm";
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 1.5);
}

TEST(SurfaceStart, IsContradictedByWhatDoesNotMoveAsTheOthersDo) {
  std::mt19937_64 random(72);
  const PeriodicSurface surface = surface_of_sixty(random);
  // An instrument over the organ, which keeps still.
  Eigen::Matrix3Xd still = Eigen::Matrix3Xd::Zero(3, kLayout.size());
  still.col(0) = 0.9 * MadeOrgan::mean_place(Vector2d(5.0, -8.0));
  const auto of_instrument = matches_of(still, 20, random);
  EXPECT_EQ(start_on_surface(surface, std::span(of_instrument), kModel).kind, SurfaceStartKind::kContradicts);
  // On the surface, and still.
  still.col(0) = MadeOrgan::mean_place(Vector2d(5.0, -8.0));
  const auto of_reflection = matches_of(still, 20, random);
  EXPECT_EQ(start_on_surface(surface, std::span(of_reflection), kModel).kind, SurfaceStartKind::kContradicts);
}

TEST(SurfaceStart, IsContradictedByWhatLiesBeforeTheSurfaceAndMovesAsItDoes) {
  std::mt19937_64 random(73);
  const PeriodicSurface surface = surface_of_sixty(random);
  Eigen::Matrix3Xd before = MadeOrgan::coefficients(Vector2d(-6.0, 3.0));
  before.col(0) *= 0.85;
  const auto matches = matches_of(before, 30, random);
  EXPECT_EQ(start_on_surface(surface, std::span(matches), kModel).kind, SurfaceStartKind::kContradicts);
}

TEST(SurfaceStart, IsNoneBesideTheSurface) {
  std::mt19937_64 random(74);
  const PeriodicSurface surface = surface_of_sixty(random);
  const auto matches = matches_of(MadeOrgan::coefficients(Vector2d(55.0, 0.0)), 30, random);
  EXPECT_EQ(start_on_surface(surface, std::span(matches), kModel).kind, SurfaceStartKind::kNotThere);
}

TEST(SurfaceStart, LetsGoOfAFirstMatchThatIsWrong) {
  std::mt19937_64 random(75);
  const PeriodicSurface surface = surface_of_sixty(random);
  const Eigen::Matrix3Xd truth = MadeOrgan::coefficients(Vector2d(4.0, 10.0));
  auto matches = matches_of(truth, 30, random);
  matches.front().z += Vector2d(40.0, -25.0);
  const SurfaceStart start = start_on_surface(surface, std::span<const Observation>(matches), kModel);
  ASSERT_EQ(start.kind, SurfaceStartKind::kStarted);
  EXPECT_EQ(start.outcome.inlier.front(), 0);
  EXPECT_LT(off(start.outcome.estimate, truth).rms_mm, 0.4);
}

TEST(SurfaceStart, CanNotUseMatchesOfAnotherLayout) {
  std::mt19937_64 random(76);
  const PeriodicSurface surface = surface_of_sixty(random);
  auto matches = matches_of(MadeOrgan::coefficients(Vector2d::Zero()), 30, random);
  for (Observation& match : matches) match.b = basis_at(BasisLayout{3, 0}, 0.1);
  EXPECT_EQ(start_on_surface(surface, std::span<const Observation>(matches), kModel).kind, SurfaceStartKind::kUnusable);
  EXPECT_EQ(start_on_surface(surface, {}, kModel).kind, SurfaceStartKind::kUnusable);
}

// What a vertex says of its position is what the prior says of it, but for where along the surface the feature lies.
TEST(SurfacePrior, IsAsUncertainAcrossTheSurfaceAsAVertexThere) {
  std::mt19937_64 random(77);
  const PeriodicSurface surface = surface_of_sixty(random);
  const std::vector<Vector2d> places = {Vector2d(2.0, 5.0)};
  const PredictedPlaces vertex = surface.predict(places);
  const std::optional<FeaturePrior> prior = prior_at(surface, places.front());
  ASSERT_TRUE(prior.has_value());
  EXPECT_LT((prior->x - test::state_of(vertex.coefficients_W_mm)).norm(), 1e-9);
  Matrix3d motion = Matrix3d::Zero();
  for (int k = 1; k <= kLayout.cardiac_harmonics; ++k) {
    const Matrix3d& L = prior->factors_mm[static_cast<std::size_t>(k)];
    motion += L * L.transpose();
  }
  const Matrix3d mean = prior->factors_mm[0] * prior->factors_mm[0].transpose();
  // The organ is a ball about a place on the axis.
  const Vector3d p = vertex.coefficients_W_mm.col(0);
  const Vector3d normal = (p - Vector3d(0.0, 0.0, 190.0)).normalized();
  EXPECT_NEAR(normal.dot((mean + motion) * normal) / normal.dot(test::covariance_of(vertex, 0) * normal), 1.0, 0.25);
  EXPECT_GT(mean.trace(), 20.0) << "free along the surface";
}

TEST(SurfacePrior, IsNoneWhereTheSurfaceHasNoSupport) {
  std::mt19937_64 random(78);
  const PeriodicSurface surface = surface_of_sixty(random);
  EXPECT_FALSE(prior_at(surface, Vector2d(70.0, 0.0)).has_value());
}

}  // namespace
}  // namespace perimap
