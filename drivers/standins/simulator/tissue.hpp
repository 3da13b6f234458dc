// What the heart's outside looks like: muscle with its fibres, vessels, fat along them. A solid texture, so that it
// needs no seams: a colour for every point of material space.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace perimap {

struct TissueSample {
  float albedo = 0.0F;                             // diffuse, grey, 0 to 1
  Eigen::Vector3f bump = Eigen::Vector3f::Zero();  // added to the unit normal before highlights are shaded
};

// `p_mm` is the material point (its place at end-diastole), `seed` another heart. No detail below about 0.4 mm.
[[nodiscard]] TissueSample tissue_at(const Eigen::Vector3f& p_mm, std::uint32_t seed) noexcept;

}  // namespace perimap
