// Pictures seen before a lens was covered or withdrawn, so coarse that they tell where it has come back to.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

// A picture of at most kSide x kSide means over blocks, less what is around each: how it is lit and the dark surround
// of a round view stay where they are when the lens moves.
struct Thumbnail {
  static constexpr int kSide = 48;

  int width = 0;
  int height = 0;
  double scale = 1;  // pixels of the picture for one of its own
  std::array<float, std::size_t{kSide} * kSide> grey{};

  [[nodiscard]] float at(int x, int y) const noexcept { return grey[static_cast<std::size_t>(y * width + x)]; }
};
[[nodiscard]] Thumbnail thumbnail_of(const GreyImage& image) noexcept;

// By how much `now` is displaced from `before`, in the picture's pixels, to about half of a thumbnail's; looked for
// within a third of either side. None where no displacement makes them alike.
[[nodiscard]] std::optional<Vector2d> displacement_between(const Thumbnail& before, const Thumbnail& now) noexcept;

// The last few places of which features have been lost together, by number.
class SeenPlaces {
 public:
  static constexpr int kMost = 4;

  // Takes the number of the oldest where there are too many.
  int remember(const Thumbnail& picture) noexcept {
    const int number = next_;
    places_[static_cast<std::size_t>(number)] = picture;
    next_ = (next_ + 1) % kMost;
    return number;
  }
  [[nodiscard]] const Thumbnail& operator[](int number) const noexcept {
    return places_[static_cast<std::size_t>(number)];
  }

 private:
  std::array<Thumbnail, kMost> places_{};
  int next_ = 0;
};

}  // namespace perimap
