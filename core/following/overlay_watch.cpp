#include "core/following/overlay_watch.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr std::size_t kMostOverlays = 512;
// Places of a trail: half a second and a fifth.
constexpr std::size_t kWindow = FeatureTrails::kLongest;
constexpr std::size_t kCandidateWindow = 6;

}  // namespace

OverlayWatch::OverlayWatch(std::size_t features, FrameRate rate, Duration barred)
    : barred_frames_(rate.frames(barred)) {
  overlays_.reserve(kMostOverlays);
  scratch_.reserve(features);
}

void OverlayWatch::let_go(std::span<FollowedFeature> features, const FeatureTrails& trails) noexcept {
  std::erase_if(overlays_, [&](const Overlay& overlay) { return overlay.until_frame <= trails.frame(); });
  if (!trails.is_due()) return;
  camera_lately_ = camera_motion(features, trails, kCandidateWindow).value_or(CameraMotion{});
  const auto camera = camera_motion(features, trails, kWindow);
  if (!camera) return;
  for (FollowedFeature& feature : features) {
    if (!is_overlay(feature, features, trails, *camera)) continue;
    bar(feature.px, trails.frame());
    feature.let_go();
    feature.is_overlay = true;
  }
}

bool OverlayWatch::may_be_overlay(const FollowedFeature& feature, const FeatureTrails& trails) const noexcept {
  constexpr double kMoved_px = 1.5;
  return camera_lately_.at(feature.px).norm() > kMoved_px && trails.has_stood_still(feature, kCandidateWindow);
}

// By what moves; known where that is most of all there is and nearly all of it goes together. Then it is the camera
// that has moved; a beating part moves beside what stands still, by more and less.
std::optional<OverlayWatch::CameraMotion> OverlayWatch::camera_motion(std::span<const FollowedFeature> features,
                                                                      const FeatureTrails& trails,
                                                                      std::size_t places) noexcept {
  constexpr std::size_t kEnoughToTell = 8;
  constexpr double kMost = 0.6, kAlike = 0.3, kAlike_px = 1.0, kOutlier = 2.5;
  std::size_t trailing = 0;
  CameraMotion camera;
  double most_px = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 2; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
    std::size_t moving = 0;
    trailing = 0;
    trails.for_each(features, places, [&](const FollowedFeature& feature, const Vector2d& from, bool stood_still) {
      ++trailing;
      const Vector2d by = feature.px - from;
      if (stood_still || (round > 0 && (by - camera.at(from)).norm() > most_px)) return;
      ++moving;
      const Eigen::Vector3d terms = CameraMotion::terms(from);
      normal += terms * terms.transpose();
      right += terms * by.transpose();
    });
    if (moving < kEnoughToTell || static_cast<double>(moving) < kMost * static_cast<double>(trailing)) {
      return std::nullopt;
    }
    camera.coefficients = normal.ldlt().solve(right);
    scratch_.clear();
    trails.for_each(features, places, [&](const FollowedFeature& feature, const Vector2d& from, bool stood_still) {
      if (!stood_still) scratch_.push_back((feature.px - from - camera.at(from)).norm());
    });
    most_px = kOutlier * upper_median(scratch_.begin(), scratch_.end());
  }
  std::size_t alike = 0;
  trails.for_each(features, places, [&](const FollowedFeature& feature, const Vector2d& from, bool stood_still) {
    const Vector2d by = camera.at(from);
    const bool is_alike = (feature.px - from - by).norm() <= kAlike * by.norm() + kAlike_px;
    alike += !stood_still && is_alike ? 1 : 0;
  });
  if (!camera.coefficients.allFinite() || static_cast<double>(alike) < kMost * static_cast<double>(trailing)) {
    return std::nullopt;
  }
  return camera;
}

// Tissue that stands still is joined to what moves: what is next to it moves little.
bool OverlayWatch::is_overlay(const FollowedFeature& feature, std::span<const FollowedFeature> features,
                              const FeatureTrails& trails, const CameraMotion& camera) noexcept {
  constexpr double kMoved_px = 3.0;
  const Vector2d by = camera.at(feature.px);
  if (!feature.found || by.norm() < kMoved_px || !trails.has_stood_still(feature, kWindow)) return false;
  double nearest = std::numeric_limits<double>::infinity();
  Vector2d beside = Vector2d::Zero();
  trails.for_each(features, kWindow, [&](const FollowedFeature& other, const Vector2d& from, bool stood_still) {
    const double distance = (other.px - feature.px).squaredNorm();
    if (stood_still || distance >= nearest) return;
    nearest = distance;
    beside = other.px - from;
  });
  return (beside - by).norm() < 0.5 * by.norm();
}

void OverlayWatch::bar(const Vector2d& px, std::uint64_t frame) noexcept {
  const Overlay overlay{px, frame + barred_frames_};
  if (overlays_.size() < kMostOverlays) {
    overlays_.push_back(overlay);
    return;
  }
  *std::min_element(overlays_.begin(), overlays_.end(),
                    [](const Overlay& a, const Overlay& b) { return a.until_frame < b.until_frame; }) = overlay;
}

}  // namespace perimap
