#include "core/surface/common_noise.hpp"

#include <algorithm>

namespace perimap {

Eigen::ArrayXXd noise_in_common(const Eigen::MatrixXd& W, const Eigen::MatrixXd& noise_mm2, double noise_scale) {
  const double share = std::max(0.0, 1.0 - noise_scale);
  const Eigen::MatrixXd weights = W.cwiseAbs();
  const Eigen::ArrayXd sums = weights.colwise().sum().transpose().array().max(1e-12);
  const Eigen::ArrayXXd noise = (weights.transpose() * noise_mm2).array();
  return share * (noise.colwise() / sums);
}

}  // namespace perimap
