// What `perimap calibrate scope` finds of a simulated scope that is turned in its camera head, without errors.
#pragma once

#include <optional>

#include "core/calibration/turned_scope.hpp"
#include "core/error/expected.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

// None where it has no field stop, or nobody has calibrated its turns.
[[nodiscard]] Expected<std::optional<TurnedScope>> calibrated_scope(const Simulation& simulation);

}  // namespace perimap
