// A Gaussian process of several outputs over one set of places.
//
// Output c of band b has the prior covariance sigma_b^2 (K + diag(nu)): one correlation K of the places for all, one
// noise nu of the observations relative to the signal, and a variance sigma_b^2 that the outputs of a band have in
// common and that the data tell (Rasmussen & Williams, Gaussian Processes for Machine Learning, MIT Press 2006, ch. 2
// and 5).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace perimap {

// Matern 5/2 of a distance, r and length in the same unit; 1 at r = 0. Of an array, element by element.
[[nodiscard]] Eigen::ArrayXXd matern52(const Eigen::ArrayXXd& r, double length);

// Distances of the columns of a and b, N x V.
[[nodiscard]] Eigen::ArrayXXd distances(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

// Which outputs have one signal variance: columns of Y, in order of `first`, each at least one wide.
struct OutputBand {
  Eigen::Index first = 0;
  Eigen::Index count = 0;
};

// The likeliest variances of the signal, and how likely that makes the data.
struct SignalFit {
  Eigen::VectorXd likeliest;  // sigma_b^2, of the outputs' unit squared
  double cost = 0.0;          // minus the logarithm of the marginal likelihood, but for constants
};

// L: lower triangle of the Cholesky factor of K + diag(nu), whose upper one is not looked at; Z = L^-1 Y. `known` as in
// GaussianProcess::create().
[[nodiscard]] SignalFit fit_signal(const Eigen::MatrixXd& L, const Eigen::MatrixXd& Z,
                                   const std::vector<OutputBand>& bands, Eigen::Index known);

class GaussianProcess {
 public:
  // K: N x N, symmetric; nu: N, not negative; Y: N x C. Nothing when K + diag(nu) is not positive definite to rounding.
  // `known`: how many numbers the prior leaves free (a constant, a slope), which the data had to tell first; below N.
  [[nodiscard]] static std::optional<GaussianProcess> create(const Eigen::MatrixXd& K, const Eigen::VectorXd& nu,
                                                             Eigen::MatrixXd Y, std::vector<OutputBand> bands,
                                                             Eigen::Index known);

  // Minus the logarithm of the marginal likelihood, but for constants, at the likeliest sigma_b.
  [[nodiscard]] double cost() const noexcept { return cost_; }
  // sigma_b^2, of the outputs' unit squared; enlarged for what the data leave open of it.
  [[nodiscard]] const Eigen::VectorXd& signal_variances() const noexcept { return signal_variances_; }
  [[nodiscard]] const std::vector<OutputBand>& bands() const noexcept { return bands_; }

  // K_star: N x V, correlations of the observations with V places. The prediction is W^T Y.
  [[nodiscard]] Eigen::MatrixXd weights(const Eigen::MatrixXd& K_star) const;
  // What of a place's own prior correlation `k` (V) is not explained, without the noise of the observations: times
  // sigma_b^2 the variance of the signal there that interpolating leaves.
  [[nodiscard]] Eigen::ArrayXd unexplained(const Eigen::MatrixXd& K_star, const Eigen::MatrixXd& W,
                                           const Eigen::ArrayXd& k) const;

  // Each observation beside what all others make of it.
  struct LeaveOneOut {
    Eigen::MatrixXd residuals;  // N x C
    Eigen::VectorXd variances;  // N; times sigma_b^2, of the residual: with the observation's own noise
  };
  [[nodiscard]] LeaveOneOut leave_one_out() const;

  // N x C: the prediction is K_star^T alpha as well.
  [[nodiscard]] const Eigen::MatrixXd& alpha() const noexcept { return alpha_; }
  [[nodiscard]] const Eigen::MatrixXd& Y() const noexcept { return Y_; }
  [[nodiscard]] const Eigen::VectorXd& nu() const noexcept { return nu_; }

 private:
  GaussianProcess() = default;

  Eigen::MatrixXd L_;      // lower: K + diag(nu) = L L^T
  Eigen::MatrixXd Y_;      // N x C
  Eigen::MatrixXd alpha_;  // (K + diag(nu))^-1 Y
  Eigen::VectorXd nu_;
  std::vector<OutputBand> bands_;
  Eigen::VectorXd signal_variances_;
  double cost_ = 0.0;
};

}  // namespace perimap
