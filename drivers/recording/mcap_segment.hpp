// Where things are in an MCAP file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/recording/mcap_format.hpp"

namespace perimap::mcap {

// Where messages are: a chunk, or a message record outside of any.
struct Segment {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;                // of the whole record
  std::vector<std::uint16_t> channel_ids;  // empty: not known
  LogTimes times;
};

struct AttachmentEntry {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

}  // namespace perimap::mcap
