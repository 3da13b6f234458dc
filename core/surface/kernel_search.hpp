// The length of a Matern kernel and the noise of its observations, by marginal likelihood.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/surface/gaussian_process.hpp"

namespace perimap {

struct Kernel {
  double length_mm = 30.0;
  double noise = 0.01;  // mean variance of the observations' own errors, as a share of the signal's
};

// What one kernel is to explain. All references outlive the search.
struct KernelProblem {
  const Eigen::ArrayXXd& r_mm;       // N x N, distances of the places
  const Eigen::MatrixXd& K_free;     // N x N, added to the kernel: of what the prior leaves free
  Eigen::Index free = 1;             // how many numbers that are
  const Eigen::VectorXd& noise_mm2;  // N: the observations' own variances as they are claimed, mean of the outputs
  const Eigen::MatrixXd& Y;          // N x C, mm
  const std::vector<OutputBand>& bands;
};

// Claimed variances are 1 where they are all zero.
[[nodiscard]] Eigen::VectorXd relative_noise(const Eigen::VectorXd& noise_mm2, double mean);

// The process at a kernel; nothing when it is not positive definite.
[[nodiscard]] std::optional<GaussianProcess> process_with(const KernelProblem& problem, const Kernel& kernel);

// How many times the claimed variances the observations are off by, as the kernel and the process have it.
[[nodiscard]] double noise_scale(const KernelProblem& problem, const Kernel& kernel, const GaussianProcess& process);

// Whether kernels are learnt, and how.
enum class KernelSearch : std::uint8_t {
  kNone,
  kNearby,  // from what was learnt of nearly the same places
  kAnew     // from anywhere
};

// From `start` down to the minimum of the cost, by a pattern search in the logarithms; the same on every machine that
// rounds alike. Where there are more than 128 places, by 128 that are spread over them. Weak priors, which matter for a
// handful of places alone: the length is about 40 mm, the claimed variances are about right.
[[nodiscard]] Kernel learn_kernel(const KernelProblem& problem, const Kernel& start,
                                  KernelSearch search = KernelSearch::kAnew);

}  // namespace perimap
