// Stretches of a simulated session in which a device is not as usual.
#pragma once

#include <cstddef>
#include <vector>

#include "core/time/instant.hpp"
#include "drivers/standins/simulator/simulation_settings.hpp"

namespace perimap {

// The stretch that it lies in; null: none.
[[nodiscard]] const SimulationSettings::Stretch* stretch_of(const std::vector<SimulationSettings::Stretch>& stretches,
                                                            Duration since) noexcept;

// Of what is measured at an even rate: the number of the sample that comes in the place of this one, which is its own
// but for a stretch in which what came in the `period` before it comes again and again.
[[nodiscard]] std::size_t looped(const std::vector<SimulationSettings::Stretch>& loops, std::size_t number,
                                 double rate_hz, Duration period) noexcept;

}  // namespace perimap
