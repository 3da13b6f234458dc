#include "daemon/setup/commands/measurement.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <system_error>

#include "daemon/command_line/outputs.hpp"
#include "daemon/command_line/same_file.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/setup/recorded_date.hpp"
#include "daemon/setup/setup_plots.hpp"
#include "drivers/json/json_seal.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {

std::string list_of(const nlohmann::json& values) {
  std::string text = "[";
  for (const auto& value : values) text += fmt::format("{}{:.8g}", text.size() > 1 ? ", " : "", value.get<double>());
  return text + "]";
}

std::string number_of(double value) {
  const std::string text = fmt::format("{:.6g}", value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string output_key(const CommonOptions& options) {
  if (options.configuration.empty()) return "";
  std::error_code error;
  const auto folder = std::filesystem::absolute(options.configuration, error).parent_path();
  const auto file = std::filesystem::absolute(options.output, error).lexically_relative(folder);
  return fmt::format("{:?}", file.string());
}

Outcome check_outputs(const CommonOptions& options, const std::vector<std::string>& inputs) {
  const std::vector<Output> outputs = {
      {"--output", options.output}, {"--html", options.html}, {"--configuration", options.configuration}};
  if (const auto apart = check_apart(outputs, {}); !apart) return refuse(apart.error(), ExitCode::kWrongUsage);
  for (const Output& output : outputs) {
    for (const std::string& input : inputs) {
      if (!output.file.empty() && !input.empty() && is_same_file(output.file, input)) {
        return refuse(fmt::format("{}: is {} itself, which is read", output.option, input), ExitCode::kWrongUsage);
      }
    }
  }
  if (!options.configuration.empty()) {
    const auto sound = load_configuration(options.configuration, {}, NamedFiles::kMayBeMissing);
    if (!sound) return refuse(sound.error(), ExitCode::kWrongUsage);
  }
  if (const auto able = check_writable(outputs); !able) return refuse(able.error());
  return {};
}

namespace {

// The configuration last: it names the others.
SetupExpected<void> write_results(const Measurement& measured, const CommonOptions& options, const nlohmann::json& json,
                                  const std::string& date, const std::string& made_from) {
  KeptResults results;
  if (!options.output.empty()) {
    const std::string text = measured.file.empty() ? json_document(sealed_json(json)) : measured.file;
    if (auto added = results.add(options.output, text); !added) return tl::unexpected(added.error());
  }
  if (!options.html.empty()) {
    // The text's first line says what it is.
    const std::string heading = measured.text.substr(0, measured.text.find('\n'));
    const std::string text = fmt::format("measured {} from {}\n{}", date, made_from, measured.text);
    if (auto added = results.add(options.html, setup_page(heading, text, measured.plots)); !added) {
      return tl::unexpected(added.error());
    }
  }
  if (!options.configuration.empty()) {
    const std::string comment = fmt::format("measured {} from {}", date, made_from);
    // The file that the configuration is to name is not in its place yet.
    const bool files_may_be_missing = !options.output.empty();
    const auto text =
        configuration_with_keys(options.configuration, measured.section, measured.keys, comment, files_may_be_missing);
    if (!text) return wrong_setup(text.error());
    if (auto added = results.add(options.configuration, *text); !added) return tl::unexpected(added.error());
  }
  if (const auto placed = results.put_in_place(); !placed) return tl::unexpected(placed.error());
  return {};
}

}  // namespace

Outcome finish(const SetupExpected<Measurement>& measured, const CommonOptions& options, const std::string& made_from,
               const std::string& recording) {
  if (!measured) return refuse(measured.error());
  const std::string date = date_of_measurement(recording);
  nlohmann::json json = measured->json;
  json["date"] = date;
  json["made_from"] = made_from;
  if (const auto written = write_results(*measured, options, json, date, made_from); !written) {
    return refuse(written.error());
  }
  if (options.json) {
    fmt::print("{}", json_document(json));
    return {};
  }
  fmt::print("{}", measured->text);
  for (const std::string& file : {options.output, options.configuration, options.html}) {
    if (!file.empty()) fmt::print("written to {}\n", file);
  }
  return {};
}

void add_common(Command& command, CommonOptions& options, bool has_unit, bool has_keys) {
  if (has_unit) {
    command.add_option("--unit", options.unit, "Unit of the files' lengths")
        ->check(OneOf({"m", "mm"}))
        ->capture_default_str();
  }
  command.add_flag("--json", options.json, "Print the result as JSON, every figure with its standard deviation");
  command.add_option("--output", options.output,
                     "Write the result to this file; one that is there is kept beside it with its date");
  command.add_option("--html", options.html, "Write a page with pictures of what the fit leaves over");
  if (has_keys) {
    command.add_option("--configuration", options.configuration,
                       "Set the measured keys in this configuration (TOML); the one before is kept with its date");
  }
}

void add_time_unit(Command& command, CommonOptions& options) {
  command
      .add_option("--time-unit", options.time_unit,
                  "Unit of the files' times. Without it they are seconds, and refused where they cannot be")
      ->check(OneOf({"s", "ms", "us", "ns"}));
}

std::string joined(const std::vector<std::string>& files) { return fmt::format("{}", fmt::join(files, ", ")); }

std::vector<std::string> named(std::vector<std::string> files) {
  std::erase(files, std::string());
  return files;
}

}  // namespace perimap
