// Knows what is laid over the picture: text, a logo.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/following/feature_trails.hpp"
#include "core/following/followed_feature.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/frame_rate.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What stands still to a few tenths of a pixel while the whole picture moves beside it is no tissue but laid over the
// picture. It is let go, and its place is not taken again for long. Takes nothing from the heap once it is made.
class OverlayWatch {
 public:
  struct Overlay {
    Vector2d px;
    std::uint64_t until_frame = 0;
  };

  // `features`: as many as there can be. `barred`: a place that shows what was laid over takes no feature so long.
  OverlayWatch(std::size_t features, FrameRate rate, Duration barred);

  // Lets go those of the features that are laid over the picture. Before this frame's places are noted in the trails.
  void let_go(std::span<FollowedFeature> features, const FeatureTrails& trails) noexcept;
  // It stands still while the camera moves, and has to wait for the proof that it is an overlay, or none.
  [[nodiscard]] bool may_be_overlay(const FollowedFeature& feature, const FeatureTrails& trails) const noexcept;
  [[nodiscard]] std::span<const Overlay> overlays() const noexcept { return overlays_; }

 private:
  // What the whole picture has gone by over some frames, as an affine function of the place.
  struct CameraMotion {
    Eigen::Matrix<double, 3, 2> coefficients = Eigen::Matrix<double, 3, 2>::Zero();
    static Eigen::Vector3d terms(const Vector2d& px) noexcept { return {1.0, kScale * px.x(), kScale * px.y()}; }
    [[nodiscard]] Vector2d at(const Vector2d& px) const noexcept { return coefficients.transpose() * terms(px); }
    static constexpr double kScale = 1e-3;  // so that all terms are of one size
  };

  [[nodiscard]] std::optional<CameraMotion> camera_motion(std::span<const FollowedFeature> features,
                                                          const FeatureTrails& trails, std::size_t places) noexcept;
  [[nodiscard]] static bool is_overlay(const FollowedFeature& feature, std::span<const FollowedFeature> features,
                                       const FeatureTrails& trails, const CameraMotion& camera) noexcept;
  void bar(const Vector2d& px, std::uint64_t frame) noexcept;

  std::uint64_t barred_frames_;
  CameraMotion camera_lately_;
  std::vector<Overlay> overlays_;
  std::vector<double> scratch_;
};

}  // namespace perimap
