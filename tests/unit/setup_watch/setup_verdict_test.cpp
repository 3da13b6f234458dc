#include "core/setup_watch/setup_verdict.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "core/angle/angle.hpp"
#include "watched_scene.hpp"

namespace perimap {
namespace {

using watched_scene::Scene;

SetupVerdict judge(const Scene& scene, std::uint32_t seed) {
  return judge_setup(
      fit_setup(watched_scene::watch(scene, seed), watched_scene::camera(), watched_scene::layout(scene)));
}

// A fit of ten numbers that are known to `deviation` each, over features that each number moves by a millimetre a unit.
SetupFit made_fit(const SetupVector& found, double deviation) {
  SetupFit fit;
  fit.state = SetupFitState::kSolved;
  fit.deviation = found;
  fit.covariance = deviation * deviation * SetupMatrix::Identity();
  fit.shift.assign(5, Eigen::Matrix<double, 3, kSetupNumbers>::Zero());
  for (auto& shift : fit.shift) shift.row(0).setOnes();
  return fit;
}

int doubted_of(const Scene& scene, int seeds) {
  int doubted = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    doubted += judge(scene, 70000U + static_cast<std::uint32_t>(seed)).state == SetupState::kDoubted ? 1 : 0;
  }
  return doubted;
}

// A few in the suite; a thousand in the long one.
int seeds() {
  const char* asked = std::getenv("PERIMAP_LONG_SWEEP");
  return asked != nullptr ? std::max(10, std::atoi(asked)) : 10;
}

TEST(SetupVerdict, BlamesTheNumberThatIsWrong) {
  SetupVector found = SetupVector::Zero();
  found(kFocalAt) = 3.0;
  const SetupVerdict verdict = judge_setup(made_fit(found, 0.3));
  EXPECT_EQ(verdict.state, SetupState::kDoubted);
  for (const SetupPart part : kSetupParts) {
    EXPECT_EQ(verdict.blamed[index_of(part)], part == SetupPart::kFocalLength);
  }
  EXPECT_NEAR(verdict.blamed_deviation(kFocalAt), 3.0, 1e-9);
  EXPECT_NEAR(verdict.blamed_uncertainty(kFocalAt), 0.3, 1e-9);
  EXPECT_NEAR(verdict.surface_mm, 3.0, 1e-9);
  EXPECT_NEAR(verdict.explained, 100.0, 1e-6);
}

TEST(SetupVerdict, BlamesTwoNumbersWhereOneDoesNotExplainIt) {
  SetupVector found = SetupVector::Zero();
  found(kFocalAt) = 3.0;
  found(kTimeAt) = 2.5;
  const SetupVerdict verdict = judge_setup(made_fit(found, 0.3));
  EXPECT_TRUE(verdict.blamed[index_of(SetupPart::kFocalLength)]);
  EXPECT_TRUE(verdict.blamed[index_of(SetupPart::kTimeOffset)]);
  EXPECT_FALSE(verdict.blamed[index_of(SetupPart::kHandEyeTurn)]);
}

TEST(SetupVerdict, DoesNotDoubtWhatHardlyMovesTheSurface) {
  SetupVector found = SetupVector::Zero();
  found(kFocalAt) = 0.8;
  EXPECT_EQ(judge_setup(made_fit(found, 0.01)).state, SetupState::kConsistent);
}

TEST(SetupVerdict, WidensByWhatTheSurfaceMayBeOffByWhetherDoubtedOrNot) {
  SetupVector found = SetupVector::Zero();
  found(kMoveAt + 2) = 0.8;
  const auto widening_mm = [&](double deviation) { return judge_setup(made_fit(found, deviation)).widening_mm; };
  EXPECT_NEAR(widening_mm(0.01), 0.8, 0.01) << "certain, and below the bound";
  EXPECT_GT(widening_mm(0.25), 0.35) << "three deviations are hardly chance";
  EXPECT_LT(widening_mm(0.4), 0.25) << "two come by chance";
  EXPECT_GT(widening_mm(0.4), 0.05) << "but not only";
}

TEST(SetupVerdict, WidensByWhatIsNotKnownToo) {
  const auto widening_mm = [](double deviation) {
    return judge_setup(made_fit(SetupVector::Zero(), deviation)).widening_mm;
  };
  EXPECT_EQ(judge_setup(made_fit(SetupVector::Zero(), 4.0)).suspected_mm, 0.0) << "that is not suspected";
  EXPECT_LT(widening_mm(0.05), 0.02);
  EXPECT_LT(widening_mm(0.5), 0.2);
  EXPECT_GT(widening_mm(4.0), 0.75) << "few features are within a millimetre with that";
}

TEST(SetupVerdict, DoesNotDoubtWhatIsNotCertain) {
  SetupVector found = SetupVector::Zero();
  found(kFocalAt) = 3.0;
  EXPECT_EQ(judge_setup(made_fit(found, 0.9)).state, SetupState::kUndetermined);
}

TEST(SetupVerdict, IsUnknownWithoutAFit) { EXPECT_EQ(judge_setup({}).state, SetupState::kUnknown); }

TEST(SetupVerdict, AnyOneMistakeOfRealSessionsIsToldWithItsName) {
  struct Mistake {
    SetupPart part;
    int number;
    double by;
  };
  for (const auto& [part, number, by] :
       {Mistake{SetupPart::kHandEyeTurn, kTurnAt, 2.0 * kDegree},
        Mistake{SetupPart::kHandEyeTurn, kTurnAt + 1, -3.0 * kDegree}, Mistake{SetupPart::kHandEyeAcross, kMoveAt, 5.0},
        Mistake{SetupPart::kHandEyeAlong, kMoveAt + 2, 10.0}, Mistake{SetupPart::kFocalLength, kFocalAt, 0.08},
        Mistake{SetupPart::kPrincipalPoint, kPrincipalPointAt, 20.0}}) {
    Scene scene;
    scene.deviation(number) = by;
    const SetupVerdict verdict = judge(scene, 17);
    EXPECT_EQ(verdict.state, SetupState::kDoubted) << number;
    EXPECT_TRUE(verdict.blamed[index_of(part)]) << number;
    EXPECT_EQ(std::count(verdict.blamed.begin(), verdict.blamed.end(), true), 1) << number;
    EXPECT_NEAR(verdict.blamed_deviation(number) / by, 1.0, 0.25) << number;
  }
}

TEST(SetupVerdictFalseAlarms, NeverOfASetupThatIsRight) {
  Scene scene;
  EXPECT_EQ(doubted_of(scene, seeds()), 0);
}

TEST(SetupVerdictFalseAlarms, NeverOfASetupThatIsRightWhereTheScopeSwaysLittle) {
  Scene scene;
  scene.sway = 0.33;
  EXPECT_EQ(doubted_of(scene, seeds()), 0);
}

TEST(SetupVerdictFalseAlarms, NeverOfASetupThatIsRightWithAnExactTracker) {
  Scene scene;
  scene.position_deviation_mm = 0.02;
  scene.rotation_deviation_rad = 1e-4;
  EXPECT_EQ(doubted_of(scene, seeds()), 0);
}

TEST(SetupVerdictFalseAlarms, NeverOfSlowErrorsOfTheTrackerThatAreTold) {
  Scene scene;
  scene.error_correlation_s = 3.0;
  EXPECT_EQ(doubted_of(scene, seeds()), 0);
}

TEST(SetupVerdictFalseAlarms, NeverOfSlowErrorsOfTheTrackerThatAreNot) {
  Scene scene;
  scene.error_correlation_s = 3.0;
  scene.correlation_told = false;
  EXPECT_EQ(doubted_of(scene, seeds()), 0);
}

TEST(SetupVerdict, AScopeThatRestsTellsNothing) {
  Scene scene;
  scene.sway = 0.0;
  EXPECT_EQ(judge(scene, 5).state, SetupState::kUndetermined);
  scene.deviation(kTurnAt) = 3.0 * kDegree;
  EXPECT_EQ(judge(scene, 5).state, SetupState::kUndetermined);
}

}  // namespace
}  // namespace perimap
