#include "daemon/evaluation/traces/vector_autoregression.hpp"

#include <Eigen/Cholesky>

namespace perimap {

VectorAutoregression::VectorAutoregression(const VectorAutoregressionSettings& settings, const Eigen::MatrixXd& samples,
                                           const Eigen::VectorXd& noise)
    : lags_(settings.lags), noise_(noise) {
  const Eigen::Index channels = samples.cols();
  const Eigen::Index equations = samples.rows() - lags_;
  const Eigen::MatrixXd Z = samples * noise.cwiseInverse().asDiagonal();
  Eigen::MatrixXd X(equations, lags_ * channels);
  for (Eigen::Index l = 0; l < lags_; ++l) {
    X.middleCols(l * channels, channels) = Z.middleRows(lags_ - 1 - l, equations);
  }
  Eigen::MatrixXd normal = X.transpose() * X;
  normal.diagonal().array() += settings.ridge;
  A_ = normal.ldlt().solve(X.transpose() * Z.bottomRows(equations));
}

Eigen::MatrixXd VectorAutoregression::predict(const Eigen::MatrixXd& samples, int count) const {
  const Eigen::Index channels = samples.cols();
  Eigen::RowVectorXd lagged(lags_ * channels);
  for (Eigen::Index l = 0; l < lags_; ++l) {
    lagged.segment(l * channels, channels) = samples.row(samples.rows() - 1 - l).cwiseQuotient(noise_.transpose());
  }
  Eigen::MatrixXd predicted(count, channels);
  for (int i = 0; i < count; ++i) {
    const Eigen::RowVectorXd next = lagged * A_;
    predicted.row(i) = next.cwiseProduct(noise_.transpose());
    const Eigen::RowVectorXd older = lagged.head((lags_ - 1) * channels);
    lagged << next, older;
  }
  return predicted;
}

}  // namespace perimap
