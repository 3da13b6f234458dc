#include "core/surface/periodic_surface.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

#include "made_organ.hpp"

namespace perimap {
namespace {

using test::kLayout;
using test::MadeOrgan;

const Vector3d kCamera = Vector3d::Zero();

TEST(PeriodicSurface, GoesThroughFeaturesThatAreExact) {
  std::mt19937_64 random(11);
  const auto places = test::places_on_disc(60, 35.0, 4.0, random);
  const auto evidence = test::evidence_on(places, 1e-4, random);
  const auto surface = PeriodicSurface::fit(kLayout, evidence, kCamera);
  ASSERT_TRUE(surface.has_value());
  const PredictedPlaces predicted = surface->predict(test::charted(surface->chart(), places));
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Matrix3Xd truth = MadeOrgan::coefficients(places[i]);
    const auto ours = predicted.coefficients_W_mm.middleRows<3>(3 * static_cast<Eigen::Index>(i));
    EXPECT_LT((ours - truth).norm(), 0.02) << i;
    EXPECT_EQ(predicted.support[i], Support::kSupported);
  }
}

TEST(PeriodicSurface, IsNearTheTruthBetweenFeatures) {
  std::mt19937_64 random(12);
  const auto evidence = test::evidence_on(test::places_on_disc(100, 40.0, 4.0, random), 0.1, random);
  const auto between = test::places_on_disc(200, 35.0, 0.0, random);
  const auto surface = PeriodicSurface::fit(kLayout, evidence, kCamera);
  ASSERT_TRUE(surface.has_value());
  const PredictedPlaces predicted = surface->predict(test::charted(surface->chart(), between));
  double squares = 0.0;
  const Basis b = basis_at(kLayout, 1.0);
  for (std::size_t i = 0; i < between.size(); ++i) {
    const auto ours = predicted.coefficients_W_mm.middleRows<3>(3 * static_cast<Eigen::Index>(i));
    squares += ((ours - MadeOrgan::coefficients(between[i])) * b).squaredNorm();
  }
  // A feature alone: sqrt(0.01 + 0.01 + 0.04) and as much again by its motion, 0.35 mm.
  EXPECT_LT(std::sqrt(squares / 200.0), 0.2);
}

TEST(PeriodicSurface, KnowsHowFarItIsOff) {
  double nees = 0.0;
  std::size_t count = 0;
  for (unsigned seed = 21; seed < 33; ++seed) {
    std::mt19937_64 random(seed);
    const auto evidence = test::evidence_on(test::places_on_disc(80, 40.0, 4.0, random), 0.15, random);
    const auto between = test::places_on_disc(60, 35.0, 0.0, random);
    const auto surface = PeriodicSurface::fit(kLayout, evidence, kCamera);
    ASSERT_TRUE(surface.has_value());
    const PredictedPlaces predicted = surface->predict(test::charted(surface->chart(), between));
    for (std::size_t i = 0; i < between.size(); ++i) {
      const auto v = static_cast<Eigen::Index>(i);
      const Matrix3d covariance = test::covariance_of(predicted, v);
      for (const double phase : {0.5, 2.0, 3.5, 5.0}) {
        const Vector3d e = (predicted.coefficients_W_mm.middleRows<3>(3 * v) - MadeOrgan::coefficients(between[i])) *
                           basis_at(kLayout, phase);
        nees += e.dot(covariance.ldlt().solve(e)) / 3.0;
        ++count;
      }
    }
    EXPECT_GT(surface->agreement().nees, 0.6);
    EXPECT_LT(surface->agreement().nees, 1.6);
  }
  nees /= static_cast<double>(count);
  EXPECT_GT(nees, 0.6);
  EXPECT_LT(nees, 1.5);
}

// All features are off by the same, as by a tracker's error that their frames shared: their neighbours do not show it.
TEST(PeriodicSurface, DoesNotTakeAnErrorInCommonForKnowledge) {
  double nees = 0.0;
  std::size_t count = 0;
  for (unsigned seed = 41; seed < 61; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    auto evidence = test::evidence_on(test::places_on_disc(60, 40.0, 4.0, random), 0.02, random);
    const double common_mm = 0.4 * normal(random);
    for (SurfaceEvidence& feature : evidence) {
      feature.x(2 * kLayout.size()) += common_mm;
      feature.mean_mm2(2, 2) += 0.16;
    }
    const auto surface = PeriodicSurface::fit(kLayout, evidence, kCamera);
    ASSERT_TRUE(surface.has_value());
    const auto between = test::places_on_disc(40, 30.0, 0.0, random);
    const PredictedPlaces predicted = surface->predict(test::charted(surface->chart(), between));
    for (std::size_t i = 0; i < between.size(); ++i) {
      const auto v = static_cast<Eigen::Index>(i);
      const double off = predicted.coefficients_W_mm(3 * v + 2, 0) - MadeOrgan::mean_place(between[i]).z();
      nees += off * off / test::covariance_of(predicted, v)(2, 2);
      ++count;
    }
  }
  nees /= static_cast<double>(count);
  EXPECT_GT(nees, 0.3);
  EXPECT_LT(nees, 2.0);
}

TEST(PeriodicSurface, GivesCovariancesThatAreNoLessThanNothing) {
  std::mt19937_64 random(13);
  const auto evidence = test::evidence_on(test::places_on_disc(40, 40.0, 4.0, random), 0.3, random);
  const auto surface = PeriodicSurface::fit(kLayout, evidence, kCamera);
  ASSERT_TRUE(surface.has_value());
  const auto anywhere = test::places_on_disc(300, 80.0, 0.0, random);
  const PredictedPlaces predicted = surface->predict(anywhere);
  for (Eigen::Index v = 0; v < 300; ++v) {
    const Matrix3d covariance = test::covariance_of(predicted, v);
    const Vector3d eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance).eigenvalues();
    EXPECT_GT(eigenvalues(0), -1e-12 * eigenvalues(2));
  }
}

TEST(PeriodicSurface, TurnsAndMovesWithItsFeatures) {
  std::mt19937_64 random(14);
  const auto places = test::places_on_disc(50, 35.0, 4.0, random);
  const auto between = test::places_on_disc(50, 35.0, 0.0, random);
  const auto evidence = test::evidence_on(places, 0.2, random);
  const Pose X{so3_exp(Vector3d(0.7, -1.1, 0.4)), Vector3d(100.0, -250.0, 30.0)};
  auto moved = evidence;
  for (SurfaceEvidence& feature : moved) {
    const int n = kLayout.size();
    for (int j = 0; j < n; ++j) {
      const Vector3d c(feature.x(j), feature.x(n + j), feature.x(2 * n + j));
      const Vector3d there = j == 0 ? X * c : Vector3d(X.R * c);
      for (int axis = 0; axis < 3; ++axis) feature.x(axis * n + j) = there(axis);
    }
    feature.mean_mm2 = X.R * feature.mean_mm2 * X.R.transpose();
    for (Matrix3d& band : feature.bands_mm2) band = X.R * band * X.R.transpose();
  }
  const auto here = PeriodicSurface::fit(kLayout, evidence, kCamera);
  const auto there = PeriodicSurface::fit(kLayout, moved, X * kCamera);
  ASSERT_TRUE(here.has_value());
  ASSERT_TRUE(there.has_value());
  std::vector<Vector2d> moved_places;
  for (const Vector2d& s : between) moved_places.push_back(there->chart().place_of(X * MadeOrgan::mean_place(s)).s);
  const PredictedPlaces a = here->predict(test::charted(here->chart(), between));
  const PredictedPlaces b = there->predict(moved_places);
  for (Eigen::Index v = 0; v < 50; ++v) {
    EXPECT_LT(
        (X * Vector3d(a.coefficients_W_mm.block<3, 1>(3 * v, 0)) - b.coefficients_W_mm.block<3, 1>(3 * v, 0)).norm(),
        1e-6);
    EXPECT_LT((X.R * a.coefficients_W_mm.block(3 * v, 1, 3, kLayout.size() - 1) -
               b.coefficients_W_mm.block(3 * v, 1, 3, kLayout.size() - 1))
                  .norm(),
              1e-6);
    EXPECT_LT((X.R * test::covariance_of(a, v) * X.R.transpose() - test::covariance_of(b, v)).norm(), 1e-6);
  }
}

TEST(PeriodicSurface, IsTheSameBitByBitEachTime) {
  std::mt19937_64 random(15);
  const auto evidence = test::evidence_on(test::places_on_disc(40, 35.0, 4.0, random), 0.2, random);
  const auto between = test::places_on_disc(200, 35.0, 0.0, random);
  const auto once = PeriodicSurface::fit(kLayout, evidence, kCamera);
  const auto again = PeriodicSurface::fit(kLayout, evidence, kCamera);
  ASSERT_TRUE(once.has_value());
  ASSERT_TRUE(again.has_value());
  EXPECT_TRUE(once->predict(between).coefficients_W_mm == again->predict(between).coefficients_W_mm);
  EXPECT_TRUE(once->predict(between).covariances_W_mm2 == again->predict(between).covariances_W_mm2);
}

TEST(PeriodicSurface, LeavesOutAFeatureThatContradictsItsNeighbours) {
  std::mt19937_64 random(16);
  auto evidence = test::evidence_on(test::places_on_disc(60, 35.0, 4.0, random), 0.1, random);
  for (const std::size_t i : {7U, 30U}) {
    Eigen::Matrix3Xd c(3, kLayout.size());
    for (int axis = 0; axis < 3; ++axis) c.row(axis) = evidence[i].x.segment(axis * kLayout.size(), kLayout.size());
    c.col(0) *= 0.9;           // an instrument, 9 mm before the tissue
    c.rightCols(8).setZero();  // that does not beat
    evidence[i].x = test::state_of(c);
  }
  const auto surface = PeriodicSurface::fit(kLayout, evidence, kCamera);
  ASSERT_TRUE(surface.has_value());
  std::vector<std::uint32_t> left_out(surface->contradicted().begin(), surface->contradicted().end());
  std::sort(left_out.begin(), left_out.end());
  EXPECT_EQ(left_out, (std::vector<std::uint32_t>{8, 31}));
  EXPECT_EQ(surface->features(), 58U);
}

TEST(PeriodicSurface, UsesTheKernelsThatItIsGiven) {
  std::mt19937_64 random(17);
  const auto evidence = test::evidence_on(test::places_on_disc(40, 35.0, 4.0, random), 0.2, random);
  SurfaceKernels kernels;
  kernels.depth = {55.0, 0.02};
  const auto surface = PeriodicSurface::fit(kLayout, evidence, kCamera, {}, kernels, KernelSearch::kNone);
  ASSERT_TRUE(surface.has_value());
  EXPECT_EQ(surface->kernels().depth.length_mm, 55.0);
  EXPECT_EQ(surface->kernels().depth.noise, 0.02);
}

TEST(PeriodicSurface, BreathesWhereTheLayoutDoes) {
  constexpr BasisLayout kBreathing{2, 2};
  std::mt19937_64 random(18);
  const auto places = test::places_on_disc(40, 35.0, 4.0, random);
  std::vector<SurfaceEvidence> evidence;
  for (const Vector2d& s : places) {
    SurfaceEvidence feature;
    feature.id = static_cast<std::uint32_t>(evidence.size() + 1);
    Eigen::Matrix3Xd c = Eigen::Matrix3Xd::Zero(3, kBreathing.size());
    c.col(0) = MadeOrgan::mean_place(s);
    for (int j = 1; j < kBreathing.size(); ++j) c.col(j) = Vector3d(j, 2.0 + 0.02 * s.x(), 0.01 * j * s.y());
    feature.x = test::state_of(c);
    feature.mean_mm2 = 1e-4 * Matrix3d::Identity();
    feature.bands_mm2.fill(1e-4 * Matrix3d::Identity());
    evidence.push_back(feature);
  }
  const auto surface = PeriodicSurface::fit(kBreathing, evidence, kCamera);
  ASSERT_TRUE(surface.has_value());
  const Vector2d s(3.0, -5.0);
  const std::vector<Vector2d> there = test::charted(surface->chart(), {s});
  const PredictedPlaces predicted = surface->predict(there);
  for (int j = 1; j < kBreathing.size(); ++j) {
    const Vector3d ours = predicted.coefficients_W_mm.block<3, 1>(0, j);
    EXPECT_LT((ours - Vector3d(j, 2.0 + 0.02 * s.x(), 0.01 * j * s.y())).norm(), 0.02) << j;
  }
}

struct Refused {
  const char* name;
  SurfaceRefusalKind kind;
  const char* says;
  void (*spoil)(std::vector<SurfaceEvidence>& evidence, Vector3d& camera);
};

TEST(PeriodicSurface, RefusesWhatIsNoSurfaceAndSaysWhy) {
  const Refused refused[] = {
      {"none", SurfaceRefusalKind::kTooFewFeatures, "0 features", [](auto& e, auto&) { e.clear(); }},
      {"seven", SurfaceRefusalKind::kTooFewFeatures, "7 features", [](auto& e, auto&) { e.resize(7); }},
      {"coefficient", SurfaceRefusalKind::kNotANumber, "feature 5",
       [](auto& e, auto&) { e[4].x(3) = std::numeric_limits<double>::quiet_NaN(); }},
      {"infinite", SurfaceRefusalKind::kNotANumber, "feature 2",
       [](auto& e, auto&) { e[1].x(0) = std::numeric_limits<double>::infinity(); }},
      {"variance", SurfaceRefusalKind::kNotANumber, "feature 3",
       [](auto& e, auto&) { e[2].mean_mm2(1, 1) = std::numeric_limits<double>::quiet_NaN(); }},
      {"negative", SurfaceRefusalKind::kNotANumber, "feature 3",
       [](auto& e, auto&) { e[2].bands_mm2[1](0, 0) = -1.0; }},
      {"layout", SurfaceRefusalKind::kNotANumber, "feature 9", [](auto& e, auto&) { e[8].x = StateVector::Zero(3); }},
      {"camera", SurfaceRefusalKind::kNotANumber, "camera",
       [](auto&, auto& c) { c.x() = std::numeric_limits<double>::quiet_NaN(); }},
      {"within", SurfaceRefusalKind::kBehindCamera, "in the middle",
       [](auto& e, auto& c) {
         c.setZero();
         for (const auto& f : e) {
           c += Vector3d(f.x(0), f.x(kLayout.size()), f.x(2 * kLayout.size())) / double(e.size());
         }
       }},
      {"behind", SurfaceRefusalKind::kBehindCamera, "feature 6",
       [](auto& e, auto&) { e[5].x(2 * kLayout.size()) = -20.0; }},
      {"line", SurfaceRefusalKind::kOnALine, "on a line",
       [](auto& e, auto&) {
         double along = -20.0;
         for (auto& f : e) {
           f.x = test::state_of(MadeOrgan::coefficients(Vector2d(along, 0.5 * along)));
           along += 1.0;
         }
       }},
      {"one place", SurfaceRefusalKind::kOnALine, "on a line",
       [](auto& e, auto&) {
         for (auto& f : e) f.x = e[0].x;
       }},
  };
  for (const Refused& r : refused) {
    std::mt19937_64 random(19);
    auto evidence = test::evidence_on(test::places_on_disc(40, 35.0, 4.0, random), 0.2, random);
    Vector3d camera = kCamera;
    r.spoil(evidence, camera);
    const auto surface = PeriodicSurface::fit(kLayout, evidence, camera);
    ASSERT_FALSE(surface.has_value()) << r.name;
    EXPECT_EQ(surface.error().kind, r.kind) << r.name;
    EXPECT_NE(surface.error().message.find(r.says), std::string::npos) << r.name << ": " << surface.error().message;
  }
}

}  // namespace
}  // namespace perimap
