// Where the features that are followed through video were, some seconds back.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/following/followed_feature.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

// Layouts of all features that were found in one frame. By them a feature that has been away for seconds is expected
// where those have it that were there with it and are followed now: its place does not go astray with every frame that
// it is away, as one does that is carried along from frame to frame.
class PastLayouts {
 public:
  static constexpr std::size_t kMost = 24;

  // `features`: places for features, numbered from 0 on.
  explicit PastLayouts(std::size_t features);

  // Of all that are tracked and found in this frame. It takes the place of the oldest that nothing away needs, or of
  // the oldest.
  void note(std::span<const FollowedFeature> features, std::uint64_t frame) noexcept;

  // The number of the newest that was noted in `frame` or before and has this feature; 0 where there is none.
  [[nodiscard]] std::uint32_t newest_with(const FollowedFeature& feature, std::size_t slot,
                                          std::uint64_t frame) const noexcept;
  // Where it was in that layout, if that is still kept and has it.
  [[nodiscard]] std::optional<Vector2d> place_in(std::uint32_t number, const FollowedFeature& feature,
                                                 std::size_t slot) const noexcept;
  // The numbers of those kept; 0 for what is empty.
  [[nodiscard]] std::array<std::uint32_t, kMost> numbers() const noexcept;

 private:
  struct Place {
    std::uint32_t id = 0;
    Vector2d px = Vector2d::Zero();
  };
  struct Layout {
    std::uint32_t number = 0;
    std::uint64_t frame = 0;
    std::vector<Place> places;
  };
  [[nodiscard]] Layout& to_be_replaced(std::span<const FollowedFeature> features) noexcept;

  std::array<Layout, kMost> layouts_;
  std::uint32_t last_number_ = 0;
};

}  // namespace perimap
