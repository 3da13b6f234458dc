// Which files of a folder hold what is known of patients, and are older than they may be kept.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct OldFile {
  std::filesystem::path path;
  std::chrono::seconds age{0};  // since it was written last
  std::uintmax_t bytes = 0;
};

// "30d", "12h", "8w". Error: what was expected.
[[nodiscard]] Expected<std::chrono::seconds> parse_age(const std::string& text);

// Recordings, checkpoints and a black box's segments, told by what they begin with and not by their names, and what is
// left of one that was not finished (.part), in this folder alone, oldest first. A link is not followed, and what is no
// regular file is left.
[[nodiscard]] Expected<std::vector<OldFile>> old_files(const std::filesystem::path& folder, std::chrono::seconds age,
                                                       std::filesystem::file_time_type now);

[[nodiscard]] Expected<void> remove_old(const OldFile& file);

struct Forgotten {
  std::size_t files = 0;
  std::uintmax_t bytes = 0;
  bool failed = false;  // something could not be read or removed, which `complain` was given
};

// Removes what old_files() finds in each of the folders, and makes sure that it is gone; `dry`: only counts it. `tell`
// is given each file that is gone, or would be; a fault ends neither the folder nor the others.
Forgotten forget_old(const std::vector<std::string>& folders, std::chrono::seconds age, bool dry,
                     const std::function<void(const OldFile&)>& tell,
                     const std::function<void(const Error&)>& complain);

// What the folder lists is on the disk: what was removed is gone, also when the machine stops right after.
void synchronise_folder(const std::filesystem::path& folder);

}  // namespace perimap
