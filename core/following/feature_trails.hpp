// Where the features that are followed through video lately were.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/following/followed_feature.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/frame_rate.hpp"

namespace perimap {

// Counts the frames that show anything, and notes a place of every feature about each 30th of a second, at any rate.
class FeatureTrails {
 public:
  static constexpr std::size_t kLongest = FollowedFeature::kTrail - 1;  // places back, half a second

  explicit FeatureTrails(FrameRate rate) noexcept;

  void next_frame() noexcept { ++frame_; }
  [[nodiscard]] std::uint64_t frame() const noexcept { return frame_; }
  // Frames from one place of a trail to the next.
  [[nodiscard]] std::uint64_t stride() const noexcept { return stride_; }
  // The number of the place that this frame belongs to.
  [[nodiscard]] std::uint64_t place() const noexcept { return frame_ / stride_; }
  // True in the frames whose places are noted.
  [[nodiscard]] bool is_due() const noexcept { return frame_ % stride_ == 0; }

  // A new feature's trail begins where it is.
  void begin(FollowedFeature& feature) const noexcept;
  void note(std::span<FollowedFeature> features) const noexcept;

  // Where it was so many places ago, 1 to its trail's length.
  [[nodiscard]] const Vector2d& at(const FollowedFeature& feature, std::size_t places_ago) const noexcept;
  // To a few tenths of a pixel, over so many places; false where its trail is shorter.
  [[nodiscard]] bool has_stood_still(const FollowedFeature& feature, std::size_t places) const noexcept;
  // Of those found that have so long a trail: the feature, where it was then, whether it has stayed there.
  template <class Function>
  void for_each(std::span<const FollowedFeature> features, std::size_t places, Function&& function) const {
    for (const FollowedFeature& feature : features) {
      if (!feature.found || feature.trail_length < places) continue;
      function(feature, at(feature, places), has_stood_still(feature, places));
    }
  }

 private:
  std::uint64_t stride_;
  std::uint64_t frame_ = 0;
};

}  // namespace perimap
