// Linear prediction of several channels from their own last samples, by least squares.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace perimap {

struct VectorAutoregressionSettings {
  int lags = 10;         // samples
  double ridge = 300.0;  // added to the normal equations' diagonal, in units of noise squared
};

// y(n + 1) = sum over l of A_l y(n - l), each channel from all, in units of its noise.
class VectorAutoregression {
 public:
  // `samples`: one row a sample, at least two more than lags. `noise`: of each channel, its unit.
  VectorAutoregression(const VectorAutoregressionSettings& settings, const Eigen::MatrixXd& samples,
                       const Eigen::VectorXd& noise);

  // The next `count` samples after `samples`, one a row.
  [[nodiscard]] Eigen::MatrixXd predict(const Eigen::MatrixXd& samples, int count) const;

 private:
  int lags_;
  Eigen::VectorXd noise_;
  Eigen::MatrixXd A_;  // lags x channels by channels; the newest lag first
};

}  // namespace perimap
