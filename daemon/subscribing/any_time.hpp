// Sums and differences of times that came from outside and may be anything: they wrap around, as nothing that is signed
// may do by itself.
#pragma once

#include <chrono>
#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

[[nodiscard]] constexpr std::int64_t wrapped_sum(std::int64_t a_ns, std::int64_t b_ns) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a_ns) + static_cast<std::uint64_t>(b_ns));
}
[[nodiscard]] constexpr std::int64_t wrapped_difference(std::int64_t a_ns, std::int64_t b_ns) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a_ns) - static_cast<std::uint64_t>(b_ns));
}

// CLOCK_MONOTONIC of another host begins elsewhere: what is too old cannot be told from what is not. No surface of this
// host's is so late or early.
[[nodiscard]] constexpr bool of_another_clock(std::int64_t release_ns, Instant receipt) noexcept {
  constexpr std::int64_t kLimit_ns = Duration(std::chrono::seconds(5)).count();
  const std::int64_t late_ns = wrapped_difference(to_ns(receipt), release_ns);
  return late_ns > kLimit_ns || late_ns < -kLimit_ns;
}

}  // namespace perimap
