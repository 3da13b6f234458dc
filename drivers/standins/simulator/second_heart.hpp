// A second heart, made by a formula: of other proportions and another motion than the one that was imaged. For what
// must notice that it has the wrong heart.
#pragma once

#include <cstdint>

#include "drivers/standins/truth/heart_mesh.hpp"

namespace perimap {

// A closed egg, blunt at its base, with a groove between its chambers, its middle at the origin and its long axis along
// z, apex downwards. It shortens, thins and twists, with two harmonics, its systole at about half of the phase. The
// seed draws its proportions: 88 to 112 mm long, 60 to 84 mm wide, two thirds to nine tenths as deep.
[[nodiscard]] HeartMesh second_heart(std::uint64_t seed);

}  // namespace perimap
