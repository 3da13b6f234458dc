// Errors that features have in common.
#pragma once

#include <Eigen/Core>

namespace perimap {

// What of observations' claimed variances the scatter about their neighbours does not show, an error that they have in
// common, remains in every prediction from them; averaged with the weights W (N x V). noise: N x K; the result V x K.
[[nodiscard]] Eigen::ArrayXXd noise_in_common(const Eigen::MatrixXd& W, const Eigen::MatrixXd& noise_mm2,
                                              double noise_scale);

}  // namespace perimap
