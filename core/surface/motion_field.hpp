// The coefficients of some harmonics over the organ: Gaussian processes of the mean place in space, with a free mean.
// Across the chart's axis and along it each has a kernel, since a camera knows the former better. Where a model of the
// organ moves by itself, its motion times a gain (model_gain.hpp) is the process' mean.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/surface/gaussian_process.hpp"
#include "core/surface/kernel_search.hpp"
#include "core/surface/model_gain.hpp"

namespace perimap {

// xx xy xz yy yz zz of a symmetric matrix a column.
using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// Harmonics of N features in the chart's axes.
struct ChartedMotion {
  ChartedHarmonics seen;
  ChartedHarmonics model;  // what a model has there; without rows: there is none
  Matrix6Xd noise_A_mm2;   // 6 x N: covariance of the position by these bands, mean over the cycle
};

class MotionField {
 public:
  struct Kernels {
    Kernel across;
    Kernel along;
    // Of what is left beside a model's motion.
    Kernel rest_across;
    Kernel rest_along;
  };

  // r_mm: N x N, distances of the mean places in space. The kernels are those given, or learnt from them. A model's
  // motion is the mean where that makes what features do likelier than a mean of nothing, and foretells each of them
  // better from the others. Nothing when no kernel explains the motion.
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
  // Of each band; empty where no model's motion is the mean.
  [[nodiscard]] const ModelGains& gains() const noexcept { return gains_; }
  // By how much the predictions at V places go with the gains, `model` being the model's harmonics there. The features
  // have told the field that part of them by which the gains are off.
  [[nodiscard]] ChartedHarmonics by_gains(const Weights& weights, const ChartedHarmonics& model) const;
  // Of one coefficient of each band, mm^2.
  [[nodiscard]] const Eigen::VectorXd& variances_across() const noexcept { return across_.process->signal_variances(); }
  [[nodiscard]] const Eigen::VectorXd& variances_along() const noexcept { return along_.process->signal_variances(); }

  struct Prediction {
    ChartedHarmonics motion;     // V
    Matrix6Xd covariance_A_mm2;  // 6 x V: of the position by these bands, mean over the cycle
  };
  // r_mm: N x V, distances of the features' mean places from V others; `model` the model's harmonics there, not looked
  // at where gains() is empty.
  [[nodiscard]] Prediction at(const Eigen::ArrayXXd& r_mm, const ChartedHarmonics& model) const;

  // Of a place that no feature tells anything of: what it may do beside the model's motion, mean over the cycle, in the
  // chart's axes. As much as features do beside it, and where the model moves more than at them, more in proportion.
  [[nodiscard]] Matrix3d unseen_A_mm2(const ChartedHarmonics& model, Eigen::Index v) const;

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
    Eigen::VectorXd noise_mm2;           // N: of one coefficient, as it is claimed
    Eigen::RowVectorXd offset_mm;        // what was taken off the outputs
    Eigen::RowVectorXd model_offset_mm;  // likewise off the model's, which stand below
    Eigen::MatrixXd model_mm;            // N x C
    Eigen::VectorXd rest_mm2;            // of each band: of one coefficient of a feature, mean square
                                         // without what is claimed of its errors
    std::optional<GaussianProcess> process;
  };

  MotionField() = default;
  [[nodiscard]] static std::optional<MotionField> fit_alone(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm,
                                                            const Kernels& kernels, KernelSearch search);
  [[nodiscard]] static std::optional<MotionField> fit_beside(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm,
                                                             const Kernels& kernels, KernelSearch search);
  [[nodiscard]] bool betters(const MotionField& other) const;
  [[nodiscard]] static bool fit(Direction& direction, const Eigen::MatrixXd& outputs_mm, Eigen::Index outputs_a_band,
                                const Eigen::ArrayXXd& r_mm, KernelSearch search);
  void claim(const ChartedMotion& motion);
  // Of both directions by their kernels.
  [[nodiscard]] bool fit_gains(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm);
  [[nodiscard]] bool fit_rest(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm, KernelSearch search);

  Kernels kernels_;
  ModelGains gains_;
  Direction across_;
  Direction along_;
  Matrix6Xd noise_A_mm2_;
};

}  // namespace perimap
