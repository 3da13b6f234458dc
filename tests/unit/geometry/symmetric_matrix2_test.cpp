#include "core/geometry/symmetric_matrix2.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

namespace perimap {
namespace {

TEST(SymmetricMatrix2, EigenvaluesAreThoseOfTheGeneralMethod) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 100; ++trial) {
    const double a = normal(random), b = normal(random), c = normal(random);
    const Matrix2d C = (Matrix2d() << a, b, b, c).finished();
    const Eigen::Vector2d expected = C.selfadjointView<Eigen::Lower>().eigenvalues();
    EXPECT_NEAR(smaller_eigenvalue(C), expected(0), 1e-12);
    EXPECT_NEAR(larger_eigenvalue(C), expected(1), 1e-12);
  }
}

TEST(SymmetricMatrix2, EigenvaluesOfADiagonalAreItsElements) {
  const Matrix2d C = Eigen::Vector2d(3.0, 0.5).asDiagonal();
  EXPECT_EQ(smaller_eigenvalue(C), 0.5);
  EXPECT_EQ(larger_eigenvalue(C), 3.0);
}

}  // namespace
}  // namespace perimap
