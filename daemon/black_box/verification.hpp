// Whether a black box is as it was written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/black_box/entry.hpp"
#include "daemon/digest/digest.hpp"

namespace perimap::black_box {

struct Verification {
  std::uint64_t segments = 0;
  std::uint64_t entries = 0;
  std::uint64_t bytes = 0;
  std::int64_t first_utc_ns = 0;
  std::int64_t last_utc_ns = 0;
  Digest digest{};  // of the last entry
  bool ended = false;
  // What is not as it was written: "FILE: entry 7, byte 1234: ...". None: all of it is, up to the last entry.
  std::vector<std::string> faults;
  // What is no fault and has to be known: the ends of runs that were killed, segments that others have removed.
  std::vector<std::string> notes;
  std::vector<Digest> ends;  // of each segment

  // Nothing was changed, and nothing can have been cut from its end.
  [[nodiscard]] bool whole() const { return faults.empty() && ended; }
};

// Of all segments in a folder, or of one of them by itself. `see` is given each entry that is as it was written, in
// order; it may be empty. Error: nothing is there, or it cannot be read.
[[nodiscard]] Expected<Verification> verify(const std::filesystem::path& folder_or_file,
                                            const std::function<void(const Entry&)>& see);

}  // namespace perimap::black_box
