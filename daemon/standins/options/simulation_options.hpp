// What the command line may say of a simulated heart: the same wherever one beats.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/command_line/command.hpp"
#include "drivers/standins/simulator/bench_scene.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

class SimulationOptions {
 public:
  explicit SimulationOptions(double duration_s = 60.0) : duration_s_(duration_s) {}

  // Returns --tracker-noise. The command writes into this object when it is parsed.
  Option* add_to(Command& command);

  // Options that are of a whole session alone.
  void add_procedure_to(Command& command);

  // What was given, or by default; an error names an option that is none.
  [[nodiscard]] Expected<SimulationSettings> settings() const;
  // Of a session of so long; with --procedure. A drawn one turns the scope where it can be turned.
  [[nodiscard]] Expected<Procedure> procedure(const SimulationSettings& settings) const;
  // The same of a bench on which a set-up is measured; its board is not set.
  [[nodiscard]] Expected<BenchSettings> bench(BenchAct act) const;
  // The tracker's, as --tracker-noise says, or with this one of the position in its place.
  [[nodiscard]] TrackerNoise noise() const { return noise(tracker_noise_mm_); }
  [[nodiscard]] TrackerNoise noise(double position_mm) const;

  [[nodiscard]] bool has_procedure() const noexcept { return !procedure_.empty(); }
  [[nodiscard]] std::uint64_t seed() const noexcept { return settings_.seed; }
  [[nodiscard]] const std::string& ecg_record() const noexcept { return settings_.ecg_record; }
  // Of the respiration channel; none: there is no such channel.
  [[nodiscard]] std::optional<Duration> breath() const;

 private:
  SimulationSettings settings_;
  double duration_s_;
  std::string size_ = "640x480";
  std::optional<double> ecg_start_s_;
  std::vector<std::string> ecg_off_;
  std::vector<std::string> tracker_stuck_;
  std::vector<std::string> camera_stuck_;
  std::vector<std::string> ecg_loops_;
  std::vector<std::string> camera_loops_;
  std::string procedure_;
  std::string motion_trace_;
  bool electromagnetic_ = false;
  double respiration_period_s_ = 4.0;
  double tracker_correlation_s_ = 0.0;
  double tracker_noise_mm_ = 1.4;
  std::optional<double> tracker_rotation_noise_deg_;
};

}  // namespace perimap
