// A model is fitted to the surface from a start nearby, knows how well, and is refused or doubted where it is
// another's.
#include "core/registration/model_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "made_model.hpp"

namespace perimap::test {
namespace {

using testing::HasSubstr;

constexpr double kDegrees = std::numbers::pi / 180.0;

class ModelFitTest : public testing::Test {
 protected:
  Pose true_X_IW() const { return {so3_exp(Vector3d(0.4, -0.9, 1.3)), Vector3d(70.0, -20.0, 110.0)}; }

  // 3 mm and 3 degrees off.
  RigidEstimate start() const {
    RigidEstimate start;
    const Matrix3d R = so3_exp(3.0 * kDegrees * Vector3d(1.0, -1.0, 0.5).normalized());
    start.X_IW = Pose{R, 3.0 * Vector3d(0.2, 1.0, -0.7).normalized()} * true_X_IW();
    start.covariance.diagonal() << Vector3d::Constant(3.0 * kDegrees * kDegrees), Vector3d::Constant(3.0);
    return start;
  }

  SurfacePoints seen(double deviation_mm = 0.1) {
    return seen_of(model_, true_X_IW().inverse(), Vector3d(1.0, 0.3, 0.2).normalized(), deviation_mm, random_);
  }

  std::mt19937_64 random_{11};
  TriangleMesh model_ = made_egg();
  ModelErrors errors_{0.0, 30.0, 0.0, 2.0, 0.0};  // points are as far apart, and err alone
};

TEST_F(ModelFitTest, FindsTheExactShapeAgainAndKnowsHowWell) {
  double nees = 0.0;
  constexpr int kTrials = 20;
  for (int trial = 0; trial < kTrials; ++trial) {
    const SurfacePoints surface = seen();
    const auto fit = fit_model(model_, surface, start(), errors_);
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_THAT(fit->doubts, testing::IsEmpty());
    const auto off = difference_at(fit->estimate, true_X_IW(), surface.positions_W_mm);
    EXPECT_LT(off.rms_mm, 0.3);
    EXPECT_LT(fit->residual_mm, 0.15);
    EXPECT_GT(fit->start_residual_mm, 1.0);
    EXPECT_GT(fit->moved_mm, 1.5);
    nees += off.nees / kTrials;
  }
  EXPECT_GT(nees, 0.3);
  EXPECT_LT(nees, 1.5);
}

TEST_F(ModelFitTest, AnErrorOfShapeMakesItLessCertain) {
  const SurfacePoints surface = seen();
  ModelErrors rough = errors_;
  rough.shape_mm = 2.0;
  const auto exact = fit_model(model_, surface, start(), errors_);
  const auto declared = fit_model(model_, surface, start(), rough);
  ASSERT_TRUE(exact && declared);
  EXPECT_GT(declared->organ_deviation_mm, 3.0 * exact->organ_deviation_mm);
  // And what the whole surface has in common is in the result as well: here three quarters of its variance.
  SurfacePoints claims_more = surface;
  claims_more.covariances_W_mm2 *= 4.0;
  ModelErrors common = errors_;
  common.common_share = 0.75;
  const auto shifted = fit_model(model_, claims_more, start(), common);
  ASSERT_TRUE(shifted) << shifted.error().message;
  EXPECT_GT(shifted->organ_deviation_mm, 1.5 * exact->organ_deviation_mm);
  common = errors_;
  common.phase_rad = 0.3;
  SurfacePoints beating = surface;
  // All of it goes to and fro, as breathing would move it: that is taken for a shift.
  beating.rates_W_mm_per_rad.colwise() = true_X_IW().R.transpose() * Vector3d(5.0, 1.5, 1.0);
  const auto at_any_phase = fit_model(model_, beating, start(), common);
  ASSERT_TRUE(at_any_phase);
  EXPECT_GT(at_any_phase->organ_deviation_mm, 1.5 * exact->organ_deviation_mm);
}

TEST_F(ModelFitTest, AnInstrumentThatWasTakenForTissueDoesNotPullIt) {
  SurfacePoints surface = seen();
  for (Eigen::Index i = 0; i < surface.size() / 12; ++i) {
    surface.positions_W_mm.col(i) += 8.0 * surface.normals_W.col(i);
  }
  const auto fit = fit_model(model_, surface, start(), errors_);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_LT(difference_at(fit->estimate, true_X_IW(), surface.positions_W_mm).rms_mm, 0.5);
  // And it is said that something is there.
  ASSERT_EQ(fit->doubts.size(), 1U);
  EXPECT_THAT(fit->doubts[0], HasSubstr("mm RMS are left between surface and model"));
}

TEST_F(ModelFitTest, AnotherShapeIsRefusedWithWhatIsLeftAndWhere) {
  const SurfacePoints surface = seen();
  const auto fit = fit_model(made_egg(40, 60, 0, {38.0, 43.0, 50.0}, 0.03), surface, start(), errors_);
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error().message, HasSubstr("another shape: "));
  EXPECT_THAT(fit.error().message, HasSubstr("mm of the model"));
}

TEST_F(ModelFitTest, AModelThatIsInsideOutIsRefused) {
  TriangleMesh turned = model_;
  for (auto& triangle : turned.triangles) std::swap(triangle[0], triangle[1]);
  const auto fit = fit_model(turned, seen(), start(), errors_);
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error().message, HasSubstr("the model faces the other way"));
}

TEST_F(ModelFitTest, AModelThatEndsBesideTheSurfaceIsRefused) {
  // Only what lies on the other side is left of it.
  TriangleMesh half = model_;
  std::erase_if(half.triangles, [&](const auto& t) { return half.vertices[t[0]].x() > -5.0; });
  const auto fit = fit_model(half, seen(), start(), errors_);
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error().message, HasSubstr("points of the surface meet the model"));
}

TEST_F(ModelFitTest, AStartThatDoesNotBelongToTheModelIsDoubted) {
  RigidEstimate certain = start();
  certain.covariance *= 0.01;
  const auto fit = fit_model(model_, seen(), certain, errors_);
  ASSERT_TRUE(fit) << fit.error().message;
  ASSERT_FALSE(fit->doubts.empty());
  EXPECT_THAT(fit->doubts.back(), HasSubstr("deviations of the start"));
}

TEST_F(ModelFitTest, WhatABallDoesNotTellIsToldByTheStart) {
  const TriangleMesh ball = made_egg(60, 80, 0, {50.0, 50.0, 50.0}, 0.0);
  const SurfacePoints surface =
      seen_of(ball, true_X_IW().inverse(), Vector3d(1.0, 0.3, 0.2).normalized(), 0.1, random_);
  const auto fit = fit_model(ball, surface, start(), errors_);
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_EQ(fit->told_by_start, 3);
  EXPECT_GT(fit->organ_deviation_mm, 1.0);
  // A surface of another shape than a ball tells all.
  EXPECT_EQ(fit_model(model_, seen(), start(), errors_)->told_by_start, 0);
}

TEST_F(ModelFitTest, NumbersThatAreNoneAreRefused) {
  const SurfacePoints surface = seen();
  RigidEstimate without = start();
  without.covariance.setZero();
  EXPECT_THAT(fit_model(model_, surface, without, errors_).error().message, HasSubstr("covariance is none"));
  SurfacePoints few = surface;
  few.positions_W_mm.conservativeResize(3, 10);
  EXPECT_THAT(fit_model(model_, few, start(), errors_).error().message,
              HasSubstr("has 10 points away from its edge, and 30 are needed"));
}

}  // namespace
}  // namespace perimap::test
