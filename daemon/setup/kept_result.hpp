// Results of a calibration as files: written whole or not at all, the one before kept beside it with its date.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

// Writes the text to a file beside `file` and puts it in its place. What was there before is then in FILE.DATE, the
// date (UTC, 20261125T183000Z) being when it was written. Nothing is changed when it fails.
[[nodiscard]] Expected<void> write_kept(const std::filesystem::path& file, std::string_view text);

struct MeasuredKey {
  std::string name;
  std::string value;  // as TOML
};

// A configuration's text with these keys of a section, in their place where they stand (commented out too), else at the
// section's end; each below a comment that says what it was made from. All other lines stay as they are.
[[nodiscard]] std::string with_keys(std::string_view text, std::string_view section,
                                    const std::vector<MeasuredKey>& keys, std::string_view comment);

// Sets the keys in the configuration file, when the result is a sound configuration; write_kept() writes it.
[[nodiscard]] Expected<void> set_keys(const std::filesystem::path& file, std::string_view section,
                                      const std::vector<MeasuredKey>& keys, std::string_view comment,
                                      bool files_may_be_missing = false);

// 2026-11-25 18:30 UTC
[[nodiscard]] std::string date_now();

}  // namespace perimap
