#include "core/periodic/basis.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/periodic/periodic_motion.hpp"

namespace perimap {
namespace {

const BasisLayout kLayouts[] = {{0, 0}, {1, 0}, {8, 0}, {kMaxHarmonics, kMaxRespiratoryHarmonics}, {0, 2}};

StateVector random_state(const BasisLayout& layout, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  StateVector x(layout.state_size());
  for (double& value : x) value = normal(generator);
  return x;
}

TEST(Basis, EqualsCosinesAndNegatedSinesOfBothPhases) {
  for (const BasisLayout& layout : kLayouts) {
    for (const double phi : {0.0, 1e-9, 1.0, std::numbers::pi, 6.2, -40.0, 1234.5}) {
      const double psi = 0.37 * phi + 0.2;
      const Basis b = basis_at(layout, phi, psi);
      ASSERT_EQ(b.size(), layout.size());
      EXPECT_EQ(b(0), 1.0);
      const int H = layout.cardiac_harmonics;
      for (int k = 1; k <= H; ++k) {
        EXPECT_NEAR(b(k), std::cos(k * phi), 1e-12);
        EXPECT_NEAR(b(H + k), -std::sin(k * phi), 1e-12);
      }
      const int H_r = layout.respiratory_harmonics;
      for (int k = 1; k <= H_r; ++k) {
        EXPECT_NEAR(b(2 * H + k), std::cos(k * psi), 1e-12);
        EXPECT_NEAR(b(2 * H + H_r + k), -std::sin(k * psi), 1e-12);
      }
    }
  }
}

TEST(Basis, RateIsTheDerivativeByCardiacPhase) {
  constexpr double kStep = 1e-6;
  for (const BasisLayout& layout : kLayouts) {
    for (const double phi : {0.0, 0.7, 3.0, -5.0}) {
      const Basis numeric = (basis_at(layout, phi + kStep, 0.4) - basis_at(layout, phi - kStep, 0.4)) / (2.0 * kStep);
      EXPECT_LT((basis_rate(layout, phi) - numeric).cwiseAbs().maxCoeff(), 1e-7);
    }
  }
}

TEST(BasisLayout, KnowsItsCapacity) {
  EXPECT_TRUE(BasisLayout(kMaxHarmonics, kMaxRespiratoryHarmonics).valid());
  EXPECT_EQ(BasisLayout(kMaxHarmonics, kMaxRespiratoryHarmonics).state_size(), kMaxState);
  EXPECT_FALSE(BasisLayout(kMaxHarmonics + 1, 0).valid());
  EXPECT_FALSE(BasisLayout(8, kMaxRespiratoryHarmonics + 1).valid());
  EXPECT_FALSE(BasisLayout(-1, 0).valid());
}

TEST(PeriodicMotion, ComesBackAfterACycle) {
  std::mt19937 generator(1);
  for (const BasisLayout& layout : kLayouts) {
    const StateVector x = random_state(layout, generator);
    const Eigen::Vector3d p = position_of(x, basis_at(layout, 0.8, 0.3));
    const double cycle = 2.0 * std::numbers::pi;
    EXPECT_LT((position_of(x, basis_at(layout, 0.8 + 3.0 * cycle, 0.3 - cycle)) - p).norm(), 1e-12);
  }
}

TEST(PeriodicMotion, VelocityIsTheDerivativeByTime) {
  std::mt19937 generator(2);
  const BasisLayout layout{8, 2};
  const StateVector x = random_state(layout, generator);
  const double rate = 7.3;  // rad/s
  const double dt = 1e-6;
  const auto at = [&](double t) { return position_of(x, basis_at(layout, 0.4 + rate * t, 1.1)); };
  const Eigen::Vector3d numeric = (at(dt) - at(-dt)) / (2.0 * dt);
  EXPECT_LT((velocity_of(x, basis_rate(layout, 0.4), rate) - numeric).norm(), 1e-5);
}

TEST(PeriodicMotion, PaperOrderIsAPermutationThatComesBack) {
  std::mt19937 generator(3);
  for (const BasisLayout& layout : kLayouts) {
    const StateVector x = random_state(layout, generator);
    const StateVector x_paper = to_paper_order(x);
    EXPECT_EQ(x_paper(1), x(layout.size())) << "the second element is the DC of y";
    EXPECT_EQ(from_paper_order(x_paper), x);
  }
}

}  // namespace
}  // namespace perimap
