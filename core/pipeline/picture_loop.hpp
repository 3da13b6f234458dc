// Whether a picture has come before, bit for bit, within the last seconds: of a video that is played in a loop, or of a
// grabber that gives its memory. A sensor has noise, so that no picture comes twice.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

#include "core/sensors/grey_image.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Pictures are known by a hash of their pixels, of large ones by that of some of their rows: noise is in all of them.
// Nothing is allocated.
class PictureLoop {
 public:
  // The next picture. True: one of the last 20 s had the same hash. Pictures of one grey throughout are passed over,
  // and what has no pixels.
  [[nodiscard]] bool seen_before(const GreyImage& image, Instant capture) noexcept;

 private:
  static constexpr Duration kLately = std::chrono::seconds(20);
  static constexpr std::uint64_t kCapacity = 8192;  // 20 s of a camera of 400 pictures a second

  struct Seen {
    Instant capture;
    std::uint64_t hash = 0;
  };
  std::array<Seen, kCapacity> seen_{};
  std::uint64_t count_ = 0;
};

}  // namespace perimap
