#include "core/surface/kernel_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace perimap {
namespace {

constexpr double kUsualLength_mm = 40.0;
constexpr double kLengthSpread = 0.7;  // of the logarithm
constexpr double kScaleSpread = 1.5;   // of the logarithm

constexpr double kShortest_mm = 4.0;
constexpr double kLongest_mm = 60.0;
constexpr double kLeastNoise = 1e-8;
constexpr double kMostNoise = 10.0;

struct Logs {
  double length = 0.0;
  double noise = 0.0;
};

Kernel kernel_of(const Logs& logs) {
  return {std::clamp(std::exp(logs.length), kShortest_mm, kLongest_mm),
          std::clamp(std::exp(logs.noise), kLeastNoise, kMostNoise)};
}

double cost_of(const KernelProblem& problem, const Logs& logs) {
  const Kernel kernel = kernel_of(logs);
  const auto process = process_with(problem, kernel);
  if (!process) return std::numeric_limits<double>::infinity();
  const double length = std::log(kernel.length_mm / kUsualLength_mm) / kLengthSpread;
  const double scale = std::log(noise_scale(problem, kernel, *process)) / kScaleSpread;
  const double cost = process->cost() + 0.5 * (length * length + scale * scale);
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

}  // namespace

Eigen::VectorXd relative_noise(const Eigen::VectorXd& noise_mm2, double mean) {
  const double claimed = noise_mm2.mean();
  if (!(claimed > 0.0)) return Eigen::VectorXd::Constant(noise_mm2.size(), mean);
  return noise_mm2 * (mean / claimed);
}

std::optional<GaussianProcess> process_with(const KernelProblem& problem, const Kernel& kernel) {
  const Eigen::MatrixXd K = matern52(problem.r_mm, kernel.length_mm).matrix() + problem.K_free;
  return GaussianProcess::create(K, relative_noise(problem.noise_mm2, kernel.noise), problem.Y, problem.bands,
                                 problem.free);
}

double noise_scale(const KernelProblem& problem, const Kernel& kernel, const GaussianProcess& process) {
  double signal_mm2 = 0.0;
  for (std::size_t b = 0; b < problem.bands.size(); ++b) {
    signal_mm2 +=
        process.signal_variances()[static_cast<Eigen::Index>(b)] * static_cast<double>(problem.bands[b].count);
  }
  signal_mm2 /= static_cast<double>(problem.Y.cols());
  const double claimed_mm2 = problem.noise_mm2.mean();
  // A tenth of a micrometre: what is exact is not expected to be more so.
  return std::max(signal_mm2 * kernel.noise, 1e-8) / std::max(claimed_mm2, 1e-8);
}

Kernel learn_kernel(const KernelProblem& problem, const Kernel& start) {
  Logs best{std::log(start.length_mm), std::log(start.noise)};
  double least = cost_of(problem, best);
  Logs step{0.5, 1.2};
  // Six halvings leave 2 % of a length and 4 % of a noise; a search along a valley is given up before it costs much
  // more.
  constexpr int kMostRounds = 40;
  int halvings = 0;
  for (int round = 0; round < kMostRounds && halvings < 6; ++round) {
    const Logs from = best;
    const std::array<Logs, 4> around = {
        Logs{from.length + step.length, from.noise}, Logs{from.length - step.length, from.noise},
        Logs{from.length, from.noise + step.noise}, Logs{from.length, from.noise - step.noise}};
    for (const Logs& there : around) {
      const double cost = cost_of(problem, there);
      if (cost < least - 1e-9) {
        least = cost;
        best = there;
      }
    }
    if (best.length == from.length && best.noise == from.noise) {
      step.length *= 0.5;
      step.noise *= 0.5;
      ++halvings;
    }
  }
  return kernel_of(best);
}

}  // namespace perimap
