#include "core/surface/gaussian_process.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace perimap {

Eigen::ArrayXXd matern52(const Eigen::ArrayXXd& r, double length) {
  const Eigen::ArrayXXd u = r * (std::sqrt(5.0) / length);
  return (1.0 + u + u.square() / 3.0) * (-u).exp();
}

Eigen::ArrayXXd distances(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::ArrayXXd squared = Eigen::ArrayXXd::Zero(a.cols(), b.cols());
  for (Eigen::Index row = 0; row < a.rows(); ++row) {
    for (Eigen::Index column = 0; column < b.cols(); ++column) {
      squared.col(column) += (a.row(row).transpose().array() - b(row, column)).square();
    }
  }
  return squared.sqrt();
}

SignalFit fit_signal(const Eigen::MatrixXd& L, const Eigen::MatrixXd& Z, const std::vector<OutputBand>& bands,
                     Eigen::Index known) {
  const double half_log_determinant = L.diagonal().array().log().sum();
  const double told = static_cast<double>(Z.rows() - known);
  SignalFit fit;
  fit.likeliest.resize(static_cast<Eigen::Index>(bands.size()));
  for (std::size_t b = 0; b < bands.size(); ++b) {
    const auto [first, count] = bands[b];
    const auto outputs = static_cast<double>(count);
    // Below it no output of a heart differs from another.
    const double likeliest = std::max(Z.middleCols(first, count).squaredNorm() / (told * outputs), 1e-12);
    fit.cost += outputs * (0.5 * told * std::log(likeliest) + half_log_determinant);
    fit.likeliest[static_cast<Eigen::Index>(b)] = likeliest;
  }
  return fit;
}

std::optional<GaussianProcess> GaussianProcess::create(const Eigen::MatrixXd& K, const Eigen::VectorXd& nu,
                                                       Eigen::MatrixXd Y, std::vector<OutputBand> bands,
                                                       Eigen::Index known) {
  GaussianProcess process;
  process.L_ = K;
  process.L_.diagonal() += nu;
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(process.L_);
  if (cholesky.info() != Eigen::Success) return std::nullopt;
  process.alpha_ = cholesky.matrixL().solve(Y);
  SignalFit fit = fit_signal(process.L_, process.alpha_, bands, known);
  if (!std::isfinite(fit.cost)) return std::nullopt;
  cholesky.matrixU().solveInPlace(process.alpha_);
  process.cost_ = fit.cost;
  process.signal_variances_ = std::move(fit.likeliest);
  for (std::size_t b = 0; b < bands.size(); ++b) {
    // Student's t has this variance where the scale was told by so many numbers.
    const double degrees = static_cast<double>((Y.rows() - known) * bands[b].count);
    process.signal_variances_[static_cast<Eigen::Index>(b)] *= degrees / std::max(degrees - 2.0, 1.0);
  }
  process.Y_ = std::move(Y);
  process.nu_ = nu;
  process.bands_ = std::move(bands);
  return process;
}

Eigen::MatrixXd GaussianProcess::weights(const Eigen::MatrixXd& K_star) const {
  Eigen::MatrixXd W = K_star;
  const auto L = L_.triangularView<Eigen::Lower>();
  L.solveInPlace(W);
  L.transpose().solveInPlace(W);
  return W;
}

Eigen::ArrayXd GaussianProcess::unexplained(const Eigen::MatrixXd& K_star, const Eigen::MatrixXd& W,
                                            const Eigen::ArrayXd& k) const {
  // k - 2 w^T k_* + w^T K w, and (K + diag(nu)) w = k_*.
  const Eigen::ArrayXd explained = (W.array() * K_star.array()).colwise().sum().transpose();
  const Eigen::ArrayXd noise = (W.array().square().matrix().transpose() * nu_).array();
  return (k - explained - noise).max(0.0);
}

GaussianProcess::LeaveOneOut GaussianProcess::leave_one_out() const {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(L_.rows(), L_.cols());
  L_.triangularView<Eigen::Lower>().solveInPlace(inverse);
  LeaveOneOut out;
  out.variances = inverse.colwise().squaredNorm().transpose().cwiseInverse();
  out.residuals = out.variances.asDiagonal() * alpha_;
  return out;
}

}  // namespace perimap
