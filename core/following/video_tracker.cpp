#include "core/following/video_tracker.hpp"

#include <chrono>
#include <utility>
#include <vector>

#include "core/vision/feature_detector.hpp"
#include "core/vision/instrument_mask.hpp"

namespace perimap {
namespace {

FollowerSettings follower_settings(const VideoTrackerSettings& settings) {
  FollowerSettings of_follower;
  of_follower.maximum = settings.features;
  if (settings.frames_per_s > 0) of_follower.rate = FrameRate(settings.frames_per_s);
  return of_follower;
}

}  // namespace

VideoTracker::VideoTracker(const VideoTrackerSettings& settings)
    : settings_(settings),
      find_interval_(follower_settings(settings).rate.frames(std::chrono::milliseconds(167))),
      follower_(follower_settings(settings)) {}

Expected<void> VideoTracker::fill_up(const GreyImage& image, const ColourImage& colour) {
  const bool is_time = settings_.first_features_alone ? !has_found_ : frames_ % find_interval_ == 0;
  ++frames_;
  if (!is_time || !follower_.saw_anything() || follower_.free() == 0) return {};
  return find(image, colour);
}

Expected<void> VideoTracker::find(const GreyImage& image, const ColourImage& colour) {
  const std::vector<Vector2d> occupied = follower_.occupied();
  GreyImage barred;
  std::vector<std::uint8_t> mask;
  const int candidates = follower_.most_candidates();
  const DetectorSettings detector = detector_settings_for_trial(image, candidates);
  if (colour.bgr != nullptr) {
    auto instruments = find_instruments(colour, image.width, image.height, detector.background_clearance_px);
    if (!instruments) return tl::unexpected(instruments.error());
    mask = *std::move(instruments);
    barred = {mask.data(), image.width, image.height, image.width};
  }
  const auto corners = find_features(image, occupied, detector, follower_.free(), barred);
  if (!corners) return tl::unexpected(corners.error());
  follower_.add(image, *corners, template_settings_for(detector));
  has_found_ = has_found_ || !corners->empty();
  return {};
}

}  // namespace perimap
