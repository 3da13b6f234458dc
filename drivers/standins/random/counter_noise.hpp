// Random numbers as a pure function of (seed, stream, index): no state, so the same whatever thread asks in what order.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace perimap {

// The finaliser of splitmix64 (Steele, Lea & Flood, OOPSLA 2014): a bijection that spreads every bit.
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t x) noexcept {
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9U;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebU;
  return x ^ (x >> 31);
}

// One independent sequence. Uniform numbers are the same everywhere; normal ones go through the C library's log and
// cos, so another library may differ in their last bit.
class CounterNoise {
 public:
  constexpr CounterNoise(std::uint64_t seed, std::uint64_t stream) noexcept
      : key_(mix64(mix64(seed + 0x9e3779b97f4a7c15U) ^ (stream * 0xd1342543de82ef95U + 1U))) {}

  [[nodiscard]] constexpr std::uint64_t bits(std::uint64_t index) const noexcept {
    return mix64(key_ + index * 0x9e3779b97f4a7c15U);
  }
  // In (0, 1).
  [[nodiscard]] constexpr double uniform(std::uint64_t index) const noexcept {
    return (static_cast<double>(bits(index) >> 11) + 0.5) * 0x1p-53;
  }
  [[nodiscard]] constexpr double uniform(std::uint64_t index, double low, double high) const noexcept {
    return low + (high - low) * uniform(index);
  }
  // Zero mean, unit variance (Box & Muller 1958); uses the uniform numbers 2 index and 2 index + 1.
  [[nodiscard]] double normal(std::uint64_t index) const noexcept {
    return std::sqrt(-2.0 * std::log(uniform(2 * index))) * std::cos(2.0 * std::numbers::pi * uniform(2 * index + 1));
  }

 private:
  std::uint64_t key_;
};

}  // namespace perimap
