// What happens to an endoscope's picture, composed on frames that it did not happen to.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/geometry/pose.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {

enum class Disturbance : std::uint8_t {
  kBlood,      // runs over a third of the picture, and is washed away
  kFog,        // on the lens: a veil over all of it
  kWiping,     // the lens is wiped on tissue: nothing but blur and light
  kWithdrawn,  // the lens is out of the body, the room is seen; it comes back to another place
  kExposure    // a step of gain and of white balance, and another one back
};
inline constexpr std::array kDisturbances = {Disturbance::kBlood, Disturbance::kFog, Disturbance::kWiping,
                                             Disturbance::kWithdrawn, Disturbance::kExposure};
[[nodiscard]] std::string_view name_of(Disturbance disturbance) noexcept;

// How long it lasts.
[[nodiscard]] double seconds_of(Disturbance disturbance) noexcept;

// By how much the picture is displaced once it is over.
[[nodiscard]] Vector2d displacement_after(Disturbance disturbance, int width, int height) noexcept;

// One frame of a picture that a disturbance happens to.
class DisturbedFrame {
 public:
  // `progress` in [0, 1) while it happens; before it below 0, after it 1 or more. What is returned is valid until the
  // next call.
  [[nodiscard]] VideoFrame compose(const VideoFrame& frame, Disturbance disturbance, double progress);

 private:
  std::vector<std::uint8_t> bgr_, grey_;
};

}  // namespace perimap
