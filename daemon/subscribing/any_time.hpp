// Sums and differences of times that came from outside and may be anything: they wrap around, as nothing that is signed
// may do by itself.
#pragma once

#include <cstdint>

namespace perimap {

[[nodiscard]] constexpr std::int64_t wrapped_sum(std::int64_t a_ns, std::int64_t b_ns) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a_ns) + static_cast<std::uint64_t>(b_ns));
}
[[nodiscard]] constexpr std::int64_t wrapped_difference(std::int64_t a_ns, std::int64_t b_ns) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a_ns) - static_cast<std::uint64_t>(b_ns));
}

}  // namespace perimap
