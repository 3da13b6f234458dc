// What the heart's outside looks like in footage: less contrast than in tissue.hpp, and that unevenly spread; under a
// film of fluid that is more uneven.
#pragma once

#include "drivers/standins/simulator/tissue.hpp"

namespace perimap {

// As tissue_at(). The film's bump may be looked up elsewhere than the albedo: it is not fixed to the material.
[[nodiscard]] TissueSample epicardium_at(const Eigen::Vector3f& p_mm, std::uint32_t seed) noexcept;

}  // namespace perimap
