// What the command line may say of a preoperative model of a simulated heart.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/command_line/command.hpp"
#include "drivers/standins/simulator/preoperative.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

class PreoperativeOptions {
 public:
  // The command writes into this object when it is parsed.
  void add_to(Command& command);

  [[nodiscard]] bool wanted() const noexcept { return !folder_.empty(); }
  // What is written into the folder, whether it is wanted or not.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;
  // That nothing is asked of a model that is not wanted. Errors name the option.
  [[nodiscard]] Expected<void> check() const;
  // The model at its phases, another heart, where a registration starts and the true one; the folder is made where it
  // is missing.
  [[nodiscard]] Expected<void> write(const Simulation& simulation) const;

 private:
  [[nodiscard]] PreoperativeSettings settings(const Simulation& simulation) const;
  // When the model is there too, as shares of the heart's cycle, and in which files.
  [[nodiscard]] std::vector<double> other_shares() const;
  [[nodiscard]] std::vector<std::string> other_names() const;
  [[nodiscard]] std::string configuration() const;

  std::filesystem::path folder_;
  double cycle_share_ = 0.75;
  double shape_mm_ = 2.0;
  double shape_length_mm_ = 30.0;
  double off_mm_ = 3.0;
  double off_deg_ = 3.0;
  int phases_ = 1;
  double motion_shift_ = 0.0;
  double motion_scale_ = 1.0;
  double motion_error_ = 0.0;
  bool other_motion_ = false;
  std::vector<std::pair<std::string, Option*>> others_;  // that mean nothing without the folder
};

}  // namespace perimap
