// How many frames there are in a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

// What lasts is stated as a duration and counted in frames: this is the one way from the one to the other. What grows
// with time from frame to frame is stated for a second, or for a frame at the usual rate, and goes by of_usual().
class FrameRate {
 public:
  static constexpr double kUsual_per_s = 30.0;

  // The usual one, 30 frames/s.
  constexpr FrameRate() noexcept = default;
  // Frames a second; anything outside 1 to 1000 counts as the nearer of the two.
  constexpr explicit FrameRate(double per_s) noexcept : per_s_(std::clamp(per_s, 1.0, 1000.0)) {}

  [[nodiscard]] constexpr double per_s() const noexcept { return per_s_; }
  // As many as take so long, to the nearest; one at least.
  [[nodiscard]] std::uint64_t frames(Duration time) const noexcept {
    return static_cast<std::uint64_t>(std::max(1LL, std::llround(to_seconds(time) * per_s_)));
  }
  // How long a frame is, of one at the usual rate: 1 at 30 frames/s, 0.5 at 60.
  [[nodiscard]] constexpr double of_usual() const noexcept { return kUsual_per_s / per_s_; }

 private:
  double per_s_ = kUsual_per_s;
};

}  // namespace perimap
