// A model that moves by itself: its series, how much of it features have, and what that gives where there are few.
#include "core/surface/model_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "core/surface/model_mesh.hpp"
#include "core/surface/six_elements.hpp"
#include "core/surface/surface_prior.hpp"
#include "made_organ.hpp"

namespace perimap {
namespace {

using test::kLayout;
using test::MadeOrgan;

constexpr double kTurn_rad = 2.0 * std::numbers::pi;
constexpr double kPhase_rad = 1.1;
constexpr std::size_t kSide = 19;  // the ball is not seen from 56 mm on
constexpr double kStep_mm = 4.0;

std::vector<double> evenly(int count, double first_rad = 0.0, double over_rad = kTurn_rad) {
  std::vector<double> phases;
  for (int k = 0; k < count; ++k) phases.push_back(first_rad + over_rad * k / count);
  return phases;
}

Vector2d bearing(std::size_t vertex) {
  const double middle = 0.5 * static_cast<double>(kSide - 1);
  return kStep_mm *
         Vector2d(static_cast<double>(vertex % kSide) - middle, static_cast<double>(vertex / kSide) - middle);
}

std::vector<TriangleMesh::Triangle> grid() {
  std::vector<TriangleMesh::Triangle> triangles;
  for (std::size_t row = 0; row + 1 < kSide; ++row) {
    for (std::size_t column = 0; column + 1 < kSide; ++column) {
      const auto a = static_cast<std::uint32_t>(row * kSide + column);
      const auto b = a + 1, c = a + static_cast<std::uint32_t>(kSide), d = c + 1;
      triangles.push_back({a, c, b});
      triangles.push_back({b, c, d});
    }
  }
  return triangles;
}

// Of the made organ: where it is right at the first phase, it moves `scale` times as much, and earlier by `shift_rad`;
// or as nothing of it does.
struct Motion {
  double scale = 1.0;
  double shift_rad = 0.0;
  bool other = false;

  [[nodiscard]] Vector3d displacement(const Vector2d& s, double phase_rad) const {
    if (other) {
      const double a = s.x() / 20.0 - s.y() / 30.0;
      return {2.0 * std::cos(phase_rad + a), 1.5 * std::sin(phase_rad - a), 2.0 * std::sin(2.0 * phase_rad + a)};
    }
    const Eigen::Matrix3Xd c = MadeOrgan::coefficients(s);
    return scale * (c.rightCols(c.cols() - 1) * basis_at(kLayout, phase_rad + shift_rad).tail(c.cols() - 1));
  }
};

PlacesByPhase places_of(const Motion& motion, const std::vector<double>& phases) {
  PlacesByPhase places;
  for (const double phase_rad : phases) {
    std::vector<Vector3d>& of_phase = places.emplace_back();
    for (std::size_t v = 0; v < kSide * kSide; ++v) {
      const Vector2d s = bearing(v);
      of_phase.emplace_back(MadeOrgan::coefficients(s) * basis_at(kLayout, phases.front()) +
                            motion.displacement(s, phase_rad) - motion.displacement(s, phases.front()));
    }
  }
  return places;
}

std::shared_ptr<const ModelMotion> model_with(const Motion& motion) {
  const std::vector<double> phases = evenly(10, kPhase_rad);
  return std::make_shared<const ModelMotion>(phases, places_of(motion, phases), grid());
}

PeriodicSurface fitted(std::size_t features, double deviation_mm, unsigned seed,
                       std::shared_ptr<const ModelMotion> model) {
  std::mt19937_64 random(seed);
  const auto places = test::places_on_disc(features, 30.0, 5.0, random);
  return PeriodicSurface::fit(kLayout, test::evidence_on(places, deviation_mm, random), Vector3d::Zero(), {}, {},
                              KernelSearch::kAnew, std::move(model))
      .value();
}

// Of the motion at places within a radius, over the cycle.
struct Off {
  double rms_mm = 0.0;
  double nees = 0.0;  // 1 when the covariances are right
};
Off off(const PeriodicSurface& surface, double within_mm) {
  Off off;
  int n = 0;
  for (std::size_t v = 0; v < kSide * kSide; ++v) {
    if (bearing(v).norm() > within_mm) continue;
    const Eigen::Matrix3Xd truth = MadeOrgan::coefficients(bearing(v));
    const PredictedMotion there = surface.motion_at(Eigen::Matrix3Xd(truth.col(0)));
    const Matrix3d information = from_six(there.covariances_W_mm2.col(0)).inverse();
    for (Eigen::Index j = 1; j < truth.cols(); ++j) {
      const Vector3d e = there.coefficients_W_mm.col(j) - truth.col(j);
      off.rms_mm += 0.5 * e.squaredNorm();
      off.nees += 0.5 * e.dot(information * e) / 3.0;
    }
    ++n;
  }
  off.rms_mm = std::sqrt(off.rms_mm / n);
  off.nees /= n;
  return off;
}

TEST(ModelMotion, HasAsManyHarmonicsAsItsPhasesTell) {
  EXPECT_EQ(harmonics_told(evenly(2)), 0);
  EXPECT_EQ(harmonics_told(evenly(3)), 1);
  EXPECT_EQ(harmonics_told(evenly(4)), 1);
  EXPECT_EQ(harmonics_told(evenly(10)), 4);
  EXPECT_EQ(harmonics_told(evenly(64)), kMaxHarmonics);
  EXPECT_EQ(harmonics_told(evenly(3, 0.0, 0.3)), 0) << "all within a twentieth of the cycle";
  EXPECT_LT(harmonics_told(evenly(10, 0.0, 0.6 * kTurn_rad)), 4) << "nothing is told of two fifths of it";
}

TEST(ModelMotion, IsTheSeriesOfEachVertexAndBetweenThemOfTheNearestPlace) {
  const auto model = model_with({});
  ASSERT_EQ(model->harmonics(), 4);
  EXPECT_EQ(model->phase_rad(), kPhase_rad);
  EXPECT_LT(model->residual_mm(), 1e-9) << "ten phases, four harmonics of nine numbers";
  const std::size_t v = 7 * kSide + 9;
  const Eigen::Matrix3Xd truth = MadeOrgan::coefficients(bearing(v)).rightCols(8);
  EXPECT_LT((model->of_vertices().middleRows<3>(3 * v) - truth).norm(), 1e-9);
  const auto at_phase = [](std::size_t vertex) {
    return Vector3d(MadeOrgan::coefficients(bearing(vertex)) * basis_at(kLayout, kPhase_rad));
  };
  EXPECT_LT((model->at(Eigen::Matrix3Xd(at_phase(v))) - truth).norm(), 1e-9);
  const Eigen::Matrix3Xd half = 0.5 * (truth + MadeOrgan::coefficients(bearing(v + 1)).rightCols(8));
  EXPECT_LT((model->at(Eigen::Matrix3Xd(0.5 * (at_phase(v) + at_phase(v + 1)))) - half).norm(), 1e-9);
}

TEST(ModelMotion, LeavesWhatMoreHarmonicsHaveToItsResidual) {
  const std::vector<double> phases = evenly(8, kPhase_rad);
  const ModelMotion model(phases, places_of({}, phases), grid());
  EXPECT_EQ(model.harmonics(), 3);
  EXPECT_GT(model.residual_mm(), 0.02);
}

TEST(ModelGain, IsByWhatTheModelIsScaledAndTurned) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  WhitenedHarmonics across, along;
  for (auto& [of, outputs] : {std::pair(&across, 4), std::pair(&along, 2)}) {
    of->model = Eigen::MatrixXd::NullaryExpr(50, outputs, [&] { return normal(random); });
    of->seen = Eigen::MatrixXd::NullaryExpr(50, outputs, [&] { return 0.1 * normal(random); });
    const int axes = outputs / 2;
    // (0.6 + 0.3 i) (a + i b)
    of->seen.leftCols(axes) += 0.6 * of->model.leftCols(axes) - 0.3 * of->model.rightCols(axes);
    of->seen.rightCols(axes) += 0.6 * of->model.rightCols(axes) + 0.3 * of->model.leftCols(axes);
  }
  const ModelGains gains = likeliest_gains(across, along, 50);
  ASSERT_EQ(gains.size(), 1U);
  const double deviation = std::sqrt(gains[0].variance);
  EXPECT_NEAR(deviation, 0.1 / std::sqrt(300.0), 0.002);
  EXPECT_NEAR(gains[0].in_step, 0.6, 4.0 * deviation);
  EXPECT_NEAR(gains[0].out_of_step, 0.3, 4.0 * deviation);
  const ModelGains none = likeliest_gains({across.seen, 0.0 * across.model}, {along.seen, 0.0 * along.model}, 50);
  EXPECT_EQ(none[0].in_step, 0.0) << "of a harmonic that the model has not";
  EXPECT_EQ(none[0].variance, 0.0);
}

// Twelve features; a surface through them alone is off by several times as much.
TEST(ModelMotion, GivesTheMotionWhereFeaturesAreFew) {
  const double alone_mm = off(fitted(12, 0.05, 51, nullptr), 40.0).rms_mm;
  for (const Motion& motion : {Motion{}, Motion{0.5, 0.0, false}, Motion{1.0, 0.2 * kTurn_rad, false}}) {
    const Off with = off(fitted(12, 0.05, 51, model_with(motion)), 40.0);
    EXPECT_LT(with.rms_mm, 0.3 * alone_mm) << motion.scale << " times as large, earlier by " << motion.shift_rad;
  }
}

TEST(ModelMotion, DoesNoHarmWhereItIsAnothers) {
  const Motion other{1.0, 0.0, true};
  for (const std::size_t features : {10, 20, 60}) {
    double alone = 0.0, with = 0.0;
    for (unsigned seed = 60; seed < 64; ++seed) {
      alone += std::pow(off(fitted(features, 0.1, seed, nullptr), 25.0).rms_mm, 2);
      with += std::pow(off(fitted(features, 0.1, seed, model_with(other)), 25.0).rms_mm, 2);
    }
    EXPECT_LT(std::sqrt(with), 1.05 * std::sqrt(alone)) << features << " features";
  }
}

TEST(ModelMotion, IsAsUncertainAsItIsOff) {
  double nees = 0.0;
  constexpr unsigned kTrials = 8;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    nees += off(fitted(25, 0.2, 70 + trial, model_with({})), 25.0).nees / kTrials;
  }
  EXPECT_GT(nees, 0.4);
  EXPECT_LT(nees, 1.5);
}

TEST(ModelMotion, IsWhatANewFeatureIsSupposedToDo) {
  const Vector2d s(6.0, -8.0);
  const auto motion_off_mm = [&](const PeriodicSurface& surface) {
    const Vector2d there = surface.chart().place_of(MadeOrgan::mean_place(s)).s;
    const auto prior = prior_at(surface, there);
    EXPECT_TRUE(prior);
    const Eigen::Matrix3Xd truth = MadeOrgan::coefficients(s);
    const Eigen::Index n = kLayout.size();
    double squares = 0.0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      squares += 0.5 * (prior->x.segment(axis * n + 1, n - 1).transpose() - truth.row(axis).tail(n - 1)).squaredNorm();
    }
    return std::sqrt(squares);
  };
  EXPECT_LT(motion_off_mm(fitted(12, 0.05, 53, model_with({0.7, 0.3, false}))),
            0.5 * motion_off_mm(fitted(12, 0.05, 53, nullptr)));
}

// The mesh is wider than the features reach: they lie within 30 mm.
TEST(ModelMotion, MovesVerticesOfWhichNoFeatureTells) {
  OrganModel organ;
  organ.motion = model_with({0.5, 0.4, false});
  organ.phase_rad = kPhase_rad;
  organ.mesh_W = {places_of({}, {kPhase_rad}).front(), grid()};
  organ.normals_W = vertex_normals(organ.mesh_W);
  const SurfaceMesh with = mesh_of(fitted(30, 0.05, 54, organ.motion), organ);
  const SurfaceMesh without = mesh_of(fitted(30, 0.05, 54, nullptr), organ);
  double square_with = 0.0, square_without = 0.0;
  for (std::size_t v = 0; v < kSide * kSide; ++v) {
    if (with.support[v] == Support::kSupported || bearing(v).norm() < 42.0) continue;
    for (const double phase_rad : evenly(7)) {
      const Basis b = basis_at(kLayout, phase_rad);
      const Vector3d truth = MadeOrgan::coefficients(bearing(v)) * b;
      const auto rows = 3 * static_cast<Eigen::Index>(v);
      square_with += (with.coefficients_W_mm.middleRows<3>(rows) * b - truth).squaredNorm();
      square_without += (without.coefficients_W_mm.middleRows<3>(rows) * b - truth).squaredNorm();
    }
  }
  EXPECT_LT(square_with, 0.04 * square_without);
  ASSERT_GT(square_without, 1.0);
}

}  // namespace
}  // namespace perimap
