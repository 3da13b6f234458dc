// What the options of a simulated heart come to together.
#pragma once

#include "core/error/expected.hpp"
#include "daemon/standins/options/scope_options.hpp"
#include "daemon/standins/options/simulation_options.hpp"
#include "drivers/standins/simulator/simulation_settings.hpp"

namespace perimap {

// Of a whole session, with its procedure where one was given. Errors name the option, or the procedure's file.
[[nodiscard]] Expected<SimulationSettings> heart_settings(const SimulationOptions& simulation,
                                                          const ScopeOptions& scope);

// On how many threads to render: as many as were asked for, or (0) as there are processors.
[[nodiscard]] unsigned rendering_threads(unsigned asked_for) noexcept;

}  // namespace perimap
