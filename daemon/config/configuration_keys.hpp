// The keys of a configuration file: one table from which files are read, checked and printed.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "daemon/config/configuration.hpp"

namespace perimap {

// A value as TOML gives it, of the types that keys can have. Integers stay integers; a key that wants a floating-point
// number takes both.
using ConfigurationValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>,
                                        std::vector<double>, std::vector<std::string>>;

struct ConfigurationKey {
  std::string section;
  std::string name;
  std::string meaning;      // one line, with the unit
  std::string expected;     // "a number from 0 to 100"
  bool names_file = false;  // of files that must be there

  // Puts the value into the configuration; false when it has the wrong type or is out of range.
  std::function<bool(const ConfigurationValue&, Configuration&)> read;
  // The configuration's value; none when the configuration leaves it open.
  std::function<std::optional<ConfigurationValue>(const Configuration&)> write;
  // Another key has taken its place: read, so that files that have it go on to work, and neither written nor offered.
  bool is_former = false;
  bool names_folder = false;  // the file is a folder
};

// In the order in which they are printed; the keys of a section stand together.
[[nodiscard]] std::span<const ConfigurationKey> configuration_keys();

}  // namespace perimap
