// What a page says: which instant of a recording it wants to show.
#pragma once

#include <string_view>

#include "core/error/expected.hpp"

namespace perimap {

struct PageRequest {
  double at_s = 0.0;       // after the recording's begin
  bool from_here = false;  // goes on from what was shown, or jumps
};

// {"at_s": 12.5, "from_here": true}. Any bytes are safe; an error is one printable line.
[[nodiscard]] Expected<PageRequest> parse_page_request(std::string_view text);

}  // namespace perimap
