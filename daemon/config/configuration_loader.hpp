// Configuration files: TOML 1.0, checked key by key against configuration_keys.
//
// Every error is one line, `FILE:LINE:COL: key 'a.b': expected ..., got ...`. Unknown keys, wrong types, values out of
// range and named files that do not exist are errors; of several the first in the file is told.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

// Whether a recording or calibration that the file names must exist. Relative names start at the file's own folder.
enum class NamedFiles { kMustExist, kMayBeMissing };

// Loads `file` over `base`: keys that the file does not hold keep the base's values.
[[nodiscard]] Expected<Configuration> load_configuration(const std::filesystem::path& file,
                                                         const Configuration& base = {},
                                                         NamedFiles named_files = NamedFiles::kMustExist);

// The same from memory; `file` stands in messages, and its folder is where relative names start.
[[nodiscard]] Expected<Configuration> parse_configuration(std::string_view text, const std::filesystem::path& file,
                                                          const Configuration& base = {},
                                                          NamedFiles named_files = NamedFiles::kMustExist);

// The configuration as TOML, all keys, each with its meaning as a comment; parsing it gives the same configuration.
[[nodiscard]] std::string to_toml(const Configuration& configuration);

}  // namespace perimap
