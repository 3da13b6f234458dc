// Features followed through video of which nothing else is known, and their number filled up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/error/expected.hpp"
#include "core/following/feature_follower.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

struct VideoTrackerSettings {
  int features = 200;                 // how many are kept followed
  bool first_features_alone = false;  // those found in the first frame that shows any
  double frames_per_s = 0;            // 0 where that is not known
};

class VideoTracker {
 public:
  explicit VideoTracker(const VideoTrackerSettings& settings);

  // Follows every feature into the next frame. Takes nothing from the heap once fill_up() has seen an image of its
  // size.
  void track_into(const GreyImage& image) noexcept { follower_.track_into(image); }
  // New features in the image followed last, when it is time for them and places are free. `colour`, when it has
  // pixels, tells instruments; it may be reduced. The error says what is wrong with the images.
  [[nodiscard]] Expected<void> fill_up(const GreyImage& image, const ColourImage& colour);

  [[nodiscard]] std::span<const FollowedFeature> features() const noexcept { return follower_.features(); }
  // For how long rows wait (ConfirmedTracks).
  [[nodiscard]] std::size_t frames_to_judge() const noexcept { return follower_.frames_to_judge(); }

 private:
  [[nodiscard]] Expected<void> find(const GreyImage& image, const ColourImage& colour);

  VideoTrackerSettings settings_;
  std::uint64_t find_interval_;  // frames
  FeatureFollower follower_;
  bool has_found_ = false;
  std::uint64_t frames_ = 0;
};

}  // namespace perimap
