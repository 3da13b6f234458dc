// The coefficients of some harmonics over the organ: Gaussian processes of the mean place in space, with a free mean.
// Across the chart's axis and along it each has a kernel, since a camera knows the former better.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/surface/gaussian_process.hpp"
#include "core/surface/kernel_search.hpp"

namespace perimap {

// xx xy xz yy yz zz of a symmetric matrix a column.
using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// Harmonics of N features in the chart's axes.
struct ChartedMotion {
  Eigen::MatrixXd across_mm;  // N x 4 B: of each band the cosine's x, y, the sine's x, y
  Eigen::MatrixXd along_mm;   // N x 2 B: of each band the cosine's z, the sine's z
  Matrix6Xd noise_A_mm2;      // 6 x N: covariance of the position by these bands, mean over the cycle
};

class MotionField {
 public:
  struct Kernels {
    Kernel across;
    Kernel along;
  };

  // r_mm: N x N, distances of the mean places in space. The kernels are those given, or learnt from them.
  // Nothing when none explains the motion.
  [[nodiscard]] static std::optional<MotionField> fit(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm,
                                                      const Kernels& kernels, KernelSearch search);

  [[nodiscard]] const Kernels& kernels() const noexcept { return kernels_; }
  // By how many times their claimed variances the features scatter about their neighbours.
  [[nodiscard]] double noise_scale_across() const noexcept { return across_.scale; }
  [[nodiscard]] double noise_scale_along() const noexcept { return along_.scale; }

  // How the features' coefficients make those of V places, and what that leaves of each place's own.
  struct Weights {
    Eigen::MatrixXd across;             // N x V
    Eigen::MatrixXd along;              // N x V
    Eigen::ArrayXd unexplained_across;  // V; times a band's variance
    Eigen::ArrayXd unexplained_along;
  };
  // r_mm: N x V, distances of the features' mean places from V others.
  [[nodiscard]] Weights weights(const Eigen::ArrayXXd& r_mm) const;
  // Of one coefficient of each band, mm^2.
  [[nodiscard]] const Eigen::VectorXd& variances_across() const noexcept { return across_.process->signal_variances(); }
  [[nodiscard]] const Eigen::VectorXd& variances_along() const noexcept { return along_.process->signal_variances(); }

  struct Prediction {
    Eigen::MatrixXd across_mm;   // V x 4 B, as in ChartedMotion
    Eigen::MatrixXd along_mm;    // V x 2 B
    Matrix6Xd covariance_A_mm2;  // 6 x V: of the position by these bands, mean over the cycle
  };
  // r_mm: N x V, distances of the features' mean places from V others.
  [[nodiscard]] Prediction at(const Eigen::ArrayXXd& r_mm) const;

  // Of each feature: mean square over the cycle, and what it should be.
  struct LeaveOneOut {
    Eigen::ArrayXd across_mm2;  // of one axis, the mean of both
    Eigen::ArrayXd across_variance_mm2;
    Eigen::ArrayXd along_mm2;
    Eigen::ArrayXd along_variance_mm2;
  };
  [[nodiscard]] LeaveOneOut leave_one_out() const;

 private:
  struct Direction {
    Kernel kernel;
    double scale = 1.0;
    Eigen::RowVectorXd offset_mm;  // what was taken off the outputs
    std::optional<GaussianProcess> process;
  };

  MotionField() = default;
  [[nodiscard]] static bool fit(Direction& direction, const Eigen::MatrixXd& outputs_mm, Eigen::Index outputs_a_band,
                                const Eigen::VectorXd& noise_mm2, const Eigen::ArrayXXd& r_mm, KernelSearch search);

  Kernels kernels_;
  Direction across_;
  Direction along_;
  Matrix6Xd noise_A_mm2_;
};

}  // namespace perimap
