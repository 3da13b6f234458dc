// What the command line may say of a simulated angled scope: how it is held, and how it is turned and zoomed meanwhile.
#pragma once

#include <optional>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/command_line/command.hpp"
#include "drivers/standins/simulator/bench_scene.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

class ScopeOptions {
 public:
  // The command writes into this object when it is parsed.
  void add_to(Command& command);

  // That what was given goes together before a heart, or where a bench has this act. Errors name the option.
  [[nodiscard]] Expected<void> check(std::optional<BenchAct> act) const;

  void apply(SimulationSettings& settings) const;
  void apply(BenchSettings& settings) const;

 private:
  // How a scope that is swung about a board is turned and zoomed meanwhile, in the order of the times.
  [[nodiscard]] std::vector<BenchSettings::Turn> bench_turns() const;

  std::optional<double> notch_deg_;
  double zoom_ = 1.0;
  std::vector<double> turn_to_deg_, turn_at_s_;
  std::vector<double> zoom_to_, zoom_at_s_;
  bool uncalibrated_ = false;
  bool second_sensor_ = false;
};

}  // namespace perimap
