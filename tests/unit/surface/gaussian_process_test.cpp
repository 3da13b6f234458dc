#include "core/surface/gaussian_process.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "core/surface/kernel_search.hpp"

namespace perimap {
namespace {

struct Drawn {
  Eigen::MatrixXd K;
  Eigen::MatrixXd K_star;
  Eigen::VectorXd nu;
  Eigen::MatrixXd Y;
};

Drawn draw(unsigned seed, Eigen::Index N, Eigen::Index V) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-40.0, 40.0);
  Drawn drawn;
  const auto fill = [&](Eigen::MatrixXd& m) {
    for (double& value : m.reshaped()) value = place(random);
  };
  Eigen::MatrixXd a(2, N);
  Eigen::MatrixXd b(2, V);
  fill(a);
  fill(b);
  drawn.K = matern52(distances(a, a), 25.0).matrix();
  drawn.K_star = matern52(distances(a, b), 25.0).matrix();
  drawn.nu.resize(N);
  drawn.Y.resize(N, 3);
  for (double& value : drawn.nu) value = 0.02 + 0.001 * std::abs(place(random));
  for (double& value : drawn.Y.reshaped()) value = 0.1 * place(random);
  return drawn;
}

// The variances of the signal without what the data leave open of them.
double likeliest(const GaussianProcess& process, Eigen::Index band, double degrees) {
  return process.signal_variances()(band) * (degrees - 2.0) / degrees;
}

TEST(GaussianProcess, EqualsTheDenseFormulas) {
  const Drawn d = draw(1, 15, 9);
  const auto process = GaussianProcess::create(d.K, d.nu, d.Y, {{0, 1}, {1, 2}}, 0);
  ASSERT_TRUE(process.has_value());
  const Eigen::MatrixXd noisy = d.K + Eigen::MatrixXd(d.nu.asDiagonal());
  const Eigen::MatrixXd inverse = noisy.inverse();
  const Eigen::MatrixXd W = process->weights(d.K_star);
  EXPECT_LT((W.transpose() * d.Y - d.K_star.transpose() * inverse * d.Y).norm(), 1e-9);
  // Variance with the observations' noise, as the dense formula has it.
  const Eigen::VectorXd dense = Eigen::VectorXd::Ones(9) - (d.K_star.transpose() * inverse * d.K_star).diagonal();
  const Eigen::VectorXd ours = process->unexplained(d.K_star, W, Eigen::ArrayXd::Ones(9)).matrix() +
                               W.array().square().matrix().transpose() * d.nu;
  EXPECT_LT((ours - dense).norm(), 1e-9);
  double cost = 1.5 * std::log(noisy.determinant());
  const double first = d.Y.col(0).dot(inverse * d.Y.col(0)) / 15.0;
  const double second = (d.Y.rightCols(2).transpose() * inverse * d.Y.rightCols(2)).trace() / 30.0;
  cost += 7.5 * std::log(first) + 15.0 * std::log(second);
  EXPECT_NEAR(process->cost(), cost, 1e-9);
  EXPECT_NEAR(likeliest(*process, 0, 15.0), first, 1e-9);
  EXPECT_NEAR(likeliest(*process, 1, 30.0), second, 1e-9);
}

TEST(GaussianProcess, LeavesOneOutAsIfItHadNeverBeenThere) {
  const Drawn d = draw(2, 12, 1);
  const auto process = GaussianProcess::create(d.K, d.nu, d.Y, {{0, 3}}, 0);
  ASSERT_TRUE(process.has_value());
  const GaussianProcess::LeaveOneOut out = process->leave_one_out();
  for (Eigen::Index i = 0; i < 12; ++i) {
    std::vector<Eigen::Index> others;
    for (Eigen::Index j = 0; j < 12; ++j) {
      if (j != i) others.push_back(j);
    }
    const Eigen::MatrixXd noisy = (d.K + Eigen::MatrixXd(d.nu.asDiagonal()))(others, others);
    const Eigen::VectorXd k = d.K(others, i);
    const Eigen::MatrixXd inverse = noisy.inverse();
    const Eigen::RowVectorXd residual = d.Y.row(i) - k.transpose() * inverse * d.Y(others, Eigen::all);
    EXPECT_LT((out.residuals.row(i) - residual).norm(), 1e-9);
    EXPECT_NEAR(out.variances(i), 1.0 + d.nu(i) - k.dot(inverse * k), 1e-9);
  }
}

TEST(GaussianProcess, RefusesWhatHasNoInverse) {
  const Eigen::MatrixXd twice = Eigen::MatrixXd::Ones(2, 2);
  EXPECT_FALSE(GaussianProcess::create(-twice, Eigen::VectorXd::Zero(2), twice, {{0, 2}}, 0).has_value());
}

TEST(KernelSearch, FindsWhatTheDataWereDrawnWith) {
  constexpr Eigen::Index kPlaces = 120;
  constexpr double kLength_mm = 22.0;
  constexpr double kNoise_mm2 = 0.04;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-45.0, 45.0);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd a(2, kPlaces);
  for (double& value : a.reshaped()) value = place(random);
  const Eigen::ArrayXXd r_mm = distances(a, a);
  Eigen::MatrixXd K = matern52(r_mm, kLength_mm).matrix();
  K.diagonal().array() += kNoise_mm2;
  const Eigen::MatrixXd L = K.llt().matrixL();
  Eigen::MatrixXd Y(kPlaces, 6);
  for (double& value : Y.reshaped()) value = normal(random);
  Y = L * Y;
  const Eigen::MatrixXd K_free = Eigen::MatrixXd::Zero(kPlaces, kPlaces);
  // The claim is twice too small.
  const Eigen::VectorXd claimed = Eigen::VectorXd::Constant(kPlaces, 0.5 * kNoise_mm2);
  const std::vector<OutputBand> bands = {{0, 6}};
  const KernelProblem problem{r_mm, K_free, 0, claimed, Y, bands};
  const Kernel kernel = learn_kernel(problem, {60.0, 0.3});
  EXPECT_NEAR(std::log(kernel.length_mm / kLength_mm), 0.0, 0.25);
  const auto process = process_with(problem, kernel);
  ASSERT_TRUE(process.has_value());
  EXPECT_NEAR(std::log(noise_scale(problem, kernel, *process) / 2.0), 0.0, 0.25);
}

}  // namespace
}  // namespace perimap
