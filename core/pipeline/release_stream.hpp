// The two ways in which surfaces are released.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace perimap {

enum class ReleaseStream : std::uint8_t {
  kFrame,  // one for each camera frame, at its capture + L
  kClock   // one at each instant of a fixed grid of the monotonic clock
};

inline constexpr std::array kReleaseStreams = {ReleaseStream::kFrame, ReleaseStream::kClock};

// As `stream` of the published samples has it.
[[nodiscard]] constexpr std::string_view name_of(ReleaseStream stream) noexcept {
  return stream == ReleaseStream::kFrame ? "frame" : "clock";
}

[[nodiscard]] constexpr std::size_t index_of(ReleaseStream stream) noexcept { return static_cast<std::size_t>(stream); }

}  // namespace perimap
