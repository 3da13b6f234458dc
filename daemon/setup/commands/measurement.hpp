// What the commands that measure a set-up have in common: options, and what is done with a result.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/command_line/command.hpp"
#include "daemon/command_line/outcome.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/pages/svg_plot.hpp"
#include "daemon/setup/kept_result.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {

// What every calibration is told besides its input.
struct CommonOptions {
  std::string unit = "m";
  std::string time_unit;  // of the files' times; empty: seconds, and what cannot be seconds is refused
  bool json = false;
  std::string output;         // the result as a file
  std::string html;           // a page with pictures
  std::string configuration;  // whose keys the result becomes

  [[nodiscard]] LengthUnit length_unit() const { return unit == "mm" ? LengthUnit::kMillimetre : LengthUnit::kMetre; }
  [[nodiscard]] std::optional<TimeUnit> unit_of_times() const { return time_unit_named(time_unit); }
};

// What a calibration gives.
struct Measurement {
  std::string text;
  nlohmann::json json;
  std::vector<MeasuredKey> keys{};  // of the configuration's section
  std::string section = "tracker";
  std::vector<Plot> plots{};  // of the page
  std::string file{};         // what --output writes; empty: the JSON
};

// Before the work begins: that what is to be written can be, and is nothing that is read, nor another of them, and that
// the configuration that is to take keys is sound.
// `inputs`: every file that an option may name; those without a name do not count.
[[nodiscard]] Outcome check_outputs(const CommonOptions& options, const std::vector<std::string>& inputs);

// Prints the measurement, and writes what is to be written; refuses with its error when there is none. `recording`:
// whose date it has; empty: now.
[[nodiscard]] Outcome finish(const SetupExpected<Measurement>& measured, const CommonOptions& options,
                             const std::string& made_from, const std::string& recording);

// --unit, --json, --output, --html and --configuration, for results that have them.
void add_common(Command& command, CommonOptions& options, bool has_unit, bool has_keys);

// --time-unit, for what reads tables over time.
void add_time_unit(Command& command, CommonOptions& options);

// --output as a value of --configuration, whose folder names start from; empty without one.
[[nodiscard]] std::string output_key(const CommonOptions& options);

// Numbers as TOML.
[[nodiscard]] std::string list_of(const nlohmann::json& values);
[[nodiscard]] std::string number_of(double value);

[[nodiscard]] std::string joined(const std::vector<std::string>& files);
// Those that have a name.
[[nodiscard]] std::vector<std::string> named(std::vector<std::string> files);

}  // namespace perimap
