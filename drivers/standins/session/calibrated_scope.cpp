#include "drivers/standins/session/calibrated_scope.hpp"

#include <utility>
#include <vector>

#include "drivers/standins/simulator/field_stop.hpp"

namespace perimap {

Expected<std::optional<TurnedScope>> calibrated_scope(const Simulation& simulation) {
  const SimulationSettings& s = simulation.settings();
  if (!s.held || !s.scope_calibrated) return std::nullopt;
  std::vector<SetupAtRotation> setups;
  Vector2d centre_px = Vector2d::Zero();
  const auto held_so = [&](const ScopeHeld& held) {
    const FieldStop stop = drawn_field_stop(s.setup_seed, s.width, s.height, held);
    const ScopeSetup turned = turned_setup(simulation.setup(), held, stop.centre_px);
    centre_px = stop.centre_px;
    SetupAtRotation setup;
    setup.rotation_rad = held.notch_rad;
    setup.X_SC = turned.X_SC;
    setup.principal_px = {turned.lens.cx, turned.lens.cy};
    setup.focal_px = {turned.lens.fx, turned.lens.fy};
    setup.radius_px = s.second_sensor ? 0.0 : stop.radius_px;  // nobody sees it
    return setup;
  };
  for (const double notch_rad : {0.0, 1.0, 2.0}) setups.push_back(held_so({notch_rad, s.held->zoom}));
  auto scope = fit_turned_scope(setups, centre_px);
  if (!scope) return tl::unexpected(std::move(scope.error()));
  if (s.second_sensor) {
    const FieldStop stop = drawn_field_stop(s.setup_seed, s.width, s.height, {0.0, s.held->zoom});
    const ScopeSetup at_0 = turned_setup(simulation.setup(), {0.0, s.held->zoom}, stop.centre_px);
    scope->second_sensor = SecondSensor{at_0.X_SS2.R, scope->axis_S, 0.0};
  } else if (s.turn) {
    const SetupAtRotation zoomed = held_so({0.0, s.turn->to.zoom});
    scope->focals.push_back({zoomed.radius_px, zoomed.focal_px});
    scope->focals = focal_table(std::move(scope->focals));
  }
  scope->width = s.width;
  scope->height = s.height;
  return *std::move(scope);
}

}  // namespace perimap
