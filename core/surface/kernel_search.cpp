#include "core/surface/kernel_search.hpp"

#include <Eigen/Cholesky>
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

// A kernel has two numbers, and so many places tell them.
constexpr Eigen::Index kMostPlaces = 128;

struct Logs {
  double length = 0.0;
  double noise = 0.0;
};

Kernel kernel_of(const Logs& logs) {
  return {std::clamp(std::exp(logs.length), kShortest_mm, kLongest_mm),
          std::clamp(std::exp(logs.noise), kLeastNoise, kMostNoise)};
}

double scale_of(const std::vector<OutputBand>& bands, const Eigen::VectorXd& signal_variances, double noise,
                double claimed_mm2) {
  double signal_mm2 = 0.0;
  Eigen::Index outputs = 0;
  for (std::size_t b = 0; b < bands.size(); ++b) {
    signal_mm2 += signal_variances[static_cast<Eigen::Index>(b)] * static_cast<double>(bands[b].count);
    outputs += bands[b].count;
  }
  signal_mm2 /= static_cast<double>(outputs);
  // A tenth of a micrometre: what is exact is not expected to be more so.
  return std::max(signal_mm2 * noise, 1e-8) / std::max(claimed_mm2, 1e-8);
}

// Places far from each other: each is the farthest from those before it.
std::vector<Eigen::Index> spread_out(const Eigen::ArrayXXd& r_mm, Eigen::Index count) {
  std::vector<Eigen::Index> chosen = {0};
  Eigen::ArrayXd nearest = r_mm.col(0);
  while (static_cast<Eigen::Index>(chosen.size()) < count) {
    Eigen::Index farthest = 0;
    nearest.maxCoeff(&farthest);
    chosen.push_back(farthest);
    nearest = nearest.min(r_mm.col(farthest));
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// The cost of a kernel over a search's places; only lower triangles are made.
class Cost {
 public:
  explicit Cost(const KernelProblem& problem) : problem_(problem), claimed_mm2_(problem.noise_mm2.mean()) {
    const Eigen::Index N = problem.Y.rows();
    places_ = spread_out(problem.r_mm, std::min(N, kMostPlaces));
    const auto count = static_cast<Eigen::Index>(places_.size());
    r_mm_.resize(count * (count + 1) / 2, 1);
    free_.resize(r_mm_.rows(), 1);
    noise_.resize(count);
    Y_ = problem.Y(places_, Eigen::all);
    const Eigen::VectorXd relative = relative_noise(problem.noise_mm2, 1.0);
    Eigen::Index at = 0;
    for (Eigen::Index column = 0; column < count; ++column) {
      noise_(column) = relative(places_[static_cast<std::size_t>(column)]);
      for (Eigen::Index row = column; row < count; ++row, ++at) {
        const Eigen::Index i = places_[static_cast<std::size_t>(row)];
        const Eigen::Index j = places_[static_cast<std::size_t>(column)];
        r_mm_(at) = problem.r_mm(i, j);
        free_(at) = problem.K_free(i, j);
      }
    }
    K_.resize(count, count);
  }

  double operator()(const Logs& logs) {
    const Kernel kernel = kernel_of(logs);
    const Eigen::ArrayXXd correlations = matern52(r_mm_, kernel.length_mm) + free_;
    const Eigen::Index count = K_.rows();
    Eigen::Index at = 0;
    for (Eigen::Index column = 0; column < count; ++column) {
      K_.col(column).tail(count - column) = correlations.col(0).segment(at, count - column);
      K_(column, column) += kernel.noise * noise_(column);
      at += count - column;
    }
    Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(K_);
    if (cholesky.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    const Eigen::MatrixXd Z = K_.triangularView<Eigen::Lower>().solve(Y_);
    const SignalFit fit = fit_signal(K_, Z, problem_.bands, problem_.free);
    const double length = std::log(kernel.length_mm / kUsualLength_mm) / kLengthSpread;
    const double scale = std::log(scale_of(problem_.bands, fit.likeliest, kernel.noise, claimed_mm2_)) / kScaleSpread;
    const double cost = fit.cost + 0.5 * (length * length + scale * scale);
    return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
  }

 private:
  const KernelProblem& problem_;
  double claimed_mm2_;
  std::vector<Eigen::Index> places_;
  Eigen::ArrayXXd r_mm_;  // lower triangle, column by column
  Eigen::ArrayXXd free_;
  Eigen::VectorXd noise_;  // relative to their mean over all places
  Eigen::MatrixXd Y_;
  Eigen::MatrixXd K_;
};

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
  return scale_of(problem.bands, process.signal_variances(), kernel.noise, problem.noise_mm2.mean());
}

Kernel learn_kernel(const KernelProblem& problem, const Kernel& start, KernelSearch search) {
  Cost cost_of(problem);
  Logs best{std::log(start.length_mm), std::log(start.noise)};
  double least = cost_of(best);
  // Of a search from anywhere, six halvings leave 2 % of a length and 4 % of a noise; of one from a kernel that was
  // learnt of nearly the same places, three leave 3 % and 8 %. One along a valley is given up before it costs much
  // more.
  const bool anew = search == KernelSearch::kAnew;
  Logs step = anew ? Logs{0.5, 1.2} : Logs{0.25, 0.6};
  const int most_halvings = anew ? 6 : 3;
  const int most_rounds = anew ? 40 : 8;
  int halvings = 0;
  for (int round = 0; round < most_rounds && halvings < most_halvings; ++round) {
    const Logs from = best;
    const std::array<Logs, 4> around = {
        Logs{from.length + step.length, from.noise}, Logs{from.length - step.length, from.noise},
        Logs{from.length, from.noise + step.noise}, Logs{from.length, from.noise - step.noise}};
    for (const Logs& there : around) {
      const double cost = cost_of(there);
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
