// Angles are in radians; these say others.
#pragma once

#include <numbers>

namespace perimap {

inline constexpr double kTwoPi = 2.0 * std::numbers::pi;
// 3.0 * kDegree.
inline constexpr double kDegree = std::numbers::pi / 180.0;

}  // namespace perimap
