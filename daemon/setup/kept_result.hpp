// Results of a calibration as files: written whole or not at all, the one before kept beside it with its date.
#pragma once

#include <cstddef>
#include <ctime>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

// The files of one measurement: all are put in their place, or none. What was there before is then in FILE.DATE, the
// date (UTC, 20261125T183000Z) being when it was written.
class KeptResults {
 public:
  KeptResults() = default;
  KeptResults(const KeptResults&) = delete;
  KeptResults& operator=(const KeptResults&) = delete;
  ~KeptResults();  // what was not put in its place is gone

  // Writes the text to a file beside `file`.
  [[nodiscard]] Expected<void> add(const std::filesystem::path& file, std::string_view text);
  // In the order of add(). Where one fails, those before it are as they were.
  [[nodiscard]] Expected<void> put_in_place();

 private:
  struct Result {
    std::filesystem::path file, written;
    std::filesystem::path kept;  // the one before; empty: there was none
  };
  [[nodiscard]] static Expected<void> keep_before(Result& result);
  void undo(std::size_t count);

  std::vector<Result> results_;
};

// One file, as KeptResults has it.
[[nodiscard]] Expected<void> write_kept(const std::filesystem::path& file, std::string_view text);

struct MeasuredKey {
  std::string name;
  std::string value;  // as TOML; empty: the key is taken out, for it does not hold any more
};

// A configuration's text with these keys of a section, in their place where they stand (commented out too), else at the
// section's end; each below a comment that says what it was made from. All other lines stay as they are.
[[nodiscard]] std::string with_keys(std::string_view text, std::string_view section,
                                    const std::vector<MeasuredKey>& keys, std::string_view comment);

// The text of the configuration file with these keys set; fails when that is no sound configuration.
[[nodiscard]] Expected<std::string> configuration_with_keys(const std::filesystem::path& file, std::string_view section,
                                                            const std::vector<MeasuredKey>& keys,
                                                            std::string_view comment,
                                                            bool files_may_be_missing = false);

// 2026-11-25 18:30 UTC
[[nodiscard]] std::string date_text_of(std::time_t time);
[[nodiscard]] std::string date_now();

}  // namespace perimap
