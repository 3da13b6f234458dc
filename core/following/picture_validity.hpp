// Where in the picture tissue can be seen, and why it can not be seen elsewhere.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/frame_rate.hpp"

namespace perimap {

enum class RegionFault : std::uint8_t {
  kNone,
  kDark,     // no light
  kGlare,    // clipped
  kVeiled,   // brighter than usual and without its contrast: fog, smoke
  kStained,  // darker than usual and without its contrast: blood, which takes the green light
  kBlurred   // as bright as usual and without its contrast: a wet or a dirty lens, wiping
};

// Each region is held against what it usually shows: its mean and its contrast, over the last seconds in which it was
// seen. The camera moves on, so that what it usually shows follows after a while whatever it shows now.
class PictureValidity {
 public:
  static constexpr int kColumns = 16, kRows = 12;

  explicit PictureValidity(const FrameRate& rate) noexcept : frames_per_s_(rate.per_s()) {}

  void look_at(const GreyImage& image) noexcept;
  // In the picture that was looked at last; outside of it what its border shows.
  [[nodiscard]] RegionFault at(const Vector2d& px) const noexcept;
  [[nodiscard]] double share_of(RegionFault fault) const noexcept;

 private:
  struct Region {
    double mean = 0, contrast = 0;  // usually, grey levels
    RegionFault fault = RegionFault::kNone;
  };
  void judge(Region& region, double mean, double contrast) const noexcept;

  double frames_per_s_;
  int width_ = 0, height_ = 0;  // of the picture
  std::array<Region, std::size_t{kColumns} * kRows> regions_{};
};

}  // namespace perimap
