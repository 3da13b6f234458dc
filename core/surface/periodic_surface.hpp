// One continuous surface through the features of the map, which moves as they do: a Gaussian process of their Fourier
// coefficients over the organ.
//
// The mean place at a bearing of the chart has a depth (DepthField), and the harmonics are fields over the mean place
// in space (MotionField); low harmonics, high ones and breathing have kernels of their own. Where a model of the organ
// moves by itself (ModelMotion), the fields are of what features do beside it. The equations are in
// docs/design/surface.md.
//
// Made off the critical path: it allocates, and takes milliseconds.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "core/periodic/basis.hpp"
#include "core/surface/depth_field.hpp"
#include "core/surface/evidence_support.hpp"
#include "core/surface/model_motion.hpp"
#include "core/surface/motion_field.hpp"
#include "core/surface/surface_chart.hpp"
#include "core/surface/surface_evidence.hpp"

namespace perimap {

struct SurfaceSettings {
  std::size_t fewest_features = 8;
  double largest_deviation_mm = 1.0;  // of the position in any direction, above which a place is not supported
  double contradiction = 5.0;         // deviations from what all others say, above which a feature is left out
};

// Harmonics that have their kernels in common.
enum class HarmonicGroup : std::uint8_t { kLow, kHigh, kBreath };
inline constexpr std::array kEveryHarmonicGroup = {HarmonicGroup::kLow, HarmonicGroup::kHigh, HarmonicGroup::kBreath};
inline constexpr std::size_t kHarmonicGroups = 3;
// The bands of a group, first and behind the last, as surface_evidence.hpp counts them.
[[nodiscard]] std::pair<int, int> bands_of(const BasisLayout& layout, HarmonicGroup group) noexcept;
struct SurfaceKernels {
  Kernel depth;
  std::array<MotionField::Kernels, kHarmonicGroups> motion;
};

enum class SurfaceRefusalKind : std::uint8_t {
  kTooFewFeatures,
  kNotANumber,    // a coefficient or a variance of a feature, or where the camera is
  kBehindCamera,  // a feature, in the chart that all of them make
  kOnALine,       // the features, as the chart has them: nothing is known to either side
  kNoKernel       // none explains them: numbers out of all reason
};
struct SurfaceRefusal {
  SurfaceRefusalKind kind{};
  std::string message;  // what and where, one line
};

// The surface as it is predicted at V places.
struct PredictedPlaces {
  Eigen::MatrixXd coefficients_W_mm;  // 3 V x basis: rows x, y, z of place 0, then of place 1
  Matrix6Xd covariances_W_mm2;        // 6 x V, of the position, mean over the cycle: xx xy xz yy yz zz
  std::vector<Support> support;       // V
};

// What moves at V places in space, without where they are.
struct PredictedMotion {
  Eigen::MatrixXd coefficients_W_mm;  // 3 V x basis, as of PredictedPlaces; the mean's are 0
  Matrix6Xd covariances_W_mm2;        // 6 x V, mean over the cycle
};

// Each feature beside what all others make of it: what the surface is worth, with no truth needed.
struct SurfaceAgreement {
  double rms_mm = 0.0;  // of the position, over cycle and features
  double nees = 0.0;    // mean of the squared differences by their variances, surface's and feature's: 1 is consistent
  std::size_t features = 0;
};

class PeriodicSurface {
 public:
  // `camera_W` (mm): where the camera has been in the mean. The kernels are those given, or learnt from them. `model`:
  // how a model of the organ moves by itself, in W; null: there is none. The result is a function of the arguments
  // alone.
  [[nodiscard]] static tl::expected<PeriodicSurface, SurfaceRefusal> fit(
      const BasisLayout& layout, std::span<const SurfaceEvidence> evidence, const Vector3d& camera_W,
      const SurfaceSettings& settings = {}, const SurfaceKernels& kernels = {},
      KernelSearch search = KernelSearch::kAnew, std::shared_ptr<const ModelMotion> model = {});

  [[nodiscard]] const BasisLayout& layout() const noexcept { return layout_; }
  [[nodiscard]] const SurfaceChart& chart() const noexcept { return chart_; }
  [[nodiscard]] const SurfaceKernels& kernels() const noexcept { return kernels_; }
  [[nodiscard]] const EvidenceSupport& support() const noexcept { return *support_; }
  [[nodiscard]] const DepthField& depth() const noexcept { return *depth_; }
  // By HarmonicGroup; without a value where the layout has no such harmonics.
  [[nodiscard]] const std::array<std::optional<MotionField>, kHarmonicGroups>& motion() const noexcept {
    return motion_;
  }

  // What one feature makes of a place goes by their distance; mean places of the features, 3 x N, mm, W.
  [[nodiscard]] const Eigen::Matrix3Xd& mean_places() const noexcept { return p_W_mm_; }
  // Of the depth at a place beyond the last features: by what the organ may have begun to turn away there. 0 elsewhere.
  [[nodiscard]] double turning_variance_mm2(const Vector2d& s, double depth_mm) const;

  // At places of the chart (mm). Those without support have figures all the same, and are to be refused.
  [[nodiscard]] PredictedPlaces predict(std::span<const Vector2d> places) const;

  // At mean places in space, 3 x V, mm, W.
  [[nodiscard]] PredictedMotion motion_at(const Eigen::Matrix3Xd& p_W_mm) const;
  // The same where it is known what the model does there, W.
  [[nodiscard]] PredictedMotion motion_at(const Eigen::Matrix3Xd& p_W_mm, const OwnHarmonics& own_W_mm) const;
  // Of places that no feature tells anything of: as much as features have of the model's motion, and no motion where
  // there is no model. What the places do beside that is in the covariances.
  [[nodiscard]] PredictedMotion unseen_motion(Eigen::Index places, const OwnHarmonics& own_W_mm) const;

  // Null without a model that moves.
  [[nodiscard]] const ModelMotion* model() const noexcept { return model_.get(); }
  // What the model does at mean places, W; without rows where there is none.
  [[nodiscard]] OwnHarmonics own_at(const Eigen::Matrix3Xd& p_W_mm) const;
  // The same in the chart's axes, by the bands of a group.
  [[nodiscard]] ChartedHarmonics charted_model(const OwnHarmonics& own_W_mm, HarmonicGroup group) const;

  [[nodiscard]] const SurfaceSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const SurfaceAgreement& agreement() const noexcept { return agreement_; }
  // The features it rests on, how many they are, and the ids of those that contradict their neighbours and were left
  // out.
  [[nodiscard]] std::span<const SurfaceEvidence> evidence() const noexcept { return evidence_; }
  [[nodiscard]] std::size_t features() const noexcept { return evidence_.size(); }
  [[nodiscard]] std::span<const std::uint32_t> contradicted() const noexcept { return contradicted_; }

 private:
  PeriodicSurface() = default;

  [[nodiscard]] tl::expected<void, SurfaceRefusal> fit_to_evidence(const Vector3d& camera_W, KernelSearch search);
  [[nodiscard]] tl::expected<void, SurfaceRefusal> place_features(const Vector3d& camera_W);
  [[nodiscard]] ChartedMotion charted_motion(HarmonicGroup group, const OwnHarmonics& own_W_mm) const;
  // By how many deviations each feature is off what all others make of it; sets agreement_.
  [[nodiscard]] std::vector<double> leave_one_out();
  [[nodiscard]] bool leave_out_contradicted();
  [[nodiscard]] OwnHarmonics own_at_features() const;
  void predict_block(std::span<const Vector2d> places, Eigen::Index first, PredictedPlaces& out) const;
  // Into the rows of places `first` and on, and on top of the covariances in the chart's axes, 6 x V.
  void add_motion(const Eigen::Matrix3Xd& p_W_mm, const OwnHarmonics& own_W_mm, Eigen::Index first,
                  Eigen::MatrixXd& coefficients_W_mm, Matrix6Xd& covariance_A_mm2) const;
  // Harmonics of a group into the rows of places `first` and on.
  void put(const ChartedHarmonics& motion, HarmonicGroup group, Eigen::Index first,
           Eigen::MatrixXd& coefficients_W_mm) const;

  BasisLayout layout_;
  SurfaceSettings settings_;
  std::shared_ptr<const ModelMotion> model_;
  std::vector<SurfaceEvidence> evidence_;
  SurfaceChart chart_;
  ChartedPlaces places_;
  Eigen::Matrix3Xd p_W_mm_;  // mean places, 3 x N
  SurfaceKernels kernels_;
  std::optional<DepthField> depth_;
  std::array<std::optional<MotionField>, kHarmonicGroups> motion_;
  std::optional<EvidenceSupport> support_;
  SurfaceAgreement agreement_;
  std::vector<std::uint32_t> contradicted_;
};

}  // namespace perimap
