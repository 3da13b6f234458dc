#include "daemon/standins/options/heart_settings.hpp"

#include <algorithm>
#include <thread>
#include <utility>

namespace perimap {

Expected<SimulationSettings> heart_settings(const SimulationOptions& simulation, const ScopeOptions& scope) {
  auto settings = simulation.settings();
  if (!settings) return tl::unexpected(settings.error());
  scope.apply(*settings);
  if (simulation.has_procedure()) {
    auto procedure = simulation.procedure(*settings);
    if (!procedure) return tl::unexpected(procedure.error());
    settings->procedure = *std::move(procedure);
  }
  return settings;
}

unsigned rendering_threads(unsigned asked_for) noexcept {
  return asked_for > 0 ? asked_for : std::max(1U, std::thread::hardware_concurrency());
}

}  // namespace perimap
