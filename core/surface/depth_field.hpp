// The depth of the mean surface over the chart: a Gaussian process with a free plane.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/surface/gaussian_process.hpp"
#include "core/surface/kernel_search.hpp"
#include "core/surface/surface_chart.hpp"

namespace perimap {

// Mean places in the chart with their covariances in its frame A.
struct ChartedPlaces {
  Eigen::Matrix2Xd s_mm;                    // 2 x N
  Eigen::VectorXd depth_mm;                 // N
  std::vector<Matrix3d> covariances_A_mm2;  // N
};

class DepthField {
 public:
  // The kernel is the one given, or learnt from it. Nothing when none explains the depths.
  [[nodiscard]] static std::optional<DepthField> fit(const SurfaceChart& chart, const ChartedPlaces& places,
                                                     const Kernel& kernel, KernelSearch search);

  [[nodiscard]] const Kernel& kernel() const noexcept { return kernel_; }
  [[nodiscard]] double noise_scale() const noexcept { return scale_; }

  struct Prediction {
    Eigen::ArrayXd depth_mm;      // V
    Eigen::ArrayXd variance_mm2;  // V
  };
  [[nodiscard]] Prediction at(const Eigen::Matrix2Xd& s_mm) const;

  // d depth / d s of the predicted surface, mm/mm.
  [[nodiscard]] Vector2d slope_at(const Vector2d& s_mm) const;

  // Of each feature, in mm along the axis and as variances.
  struct LeaveOneOut {
    Eigen::ArrayXd residuals_mm;
    Eigen::ArrayXd variances_mm2;
  };
  [[nodiscard]] LeaveOneOut leave_one_out() const;

 private:
  DepthField() = default;

  [[nodiscard]] Eigen::MatrixXd free_plane(const Eigen::Matrix2Xd& a, const Eigen::Matrix2Xd& b) const;

  Kernel kernel_;
  double scale_ = 1.0;
  double plane_mm_ = 1.0;  // over so many mm the free plane may rise as much as it may be off
  Eigen::Matrix2Xd s_mm_;
  double mean_mm_ = 0.0;
  Eigen::VectorXd noise_mm2_;
  std::optional<GaussianProcess> process_;
};

}  // namespace perimap
