// Configuration files: TOML 1.0, checked key by key against configuration_keys.
//
// Unknown keys, wrong types, values out of range and named files that do not exist are errors. All of them are told, in
// the order of the file, a line each: `FILE:LINE:COL: key 'a.b': expected ..., got ...`, and of an unknown key which
// one may have been meant. Of good values the same is told where they do not go together.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

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

// What becomes of the keys of a recording's configuration that do not describe its session (describes_session).
enum class OtherKeys { kRefused, kPassedOver };

struct RecordedConfiguration {
  Configuration configuration;
  std::vector<Error> passed_over;  // a line for each such key; none where they are refused
};

// The configuration that a recording brings along, over `base`. A file that came from elsewhere must not decide which
// files are written, which devices are opened and what is published. `name` stands in messages.
[[nodiscard]] Expected<RecordedConfiguration> parse_recorded_configuration(std::string_view text,
                                                                           const std::string& name,
                                                                           const Configuration& base = {},
                                                                           OtherKeys others = OtherKeys::kRefused);

}  // namespace perimap
