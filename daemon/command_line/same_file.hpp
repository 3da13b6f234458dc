// Whether a command would write over what it reads.
#pragma once

#include <string>

namespace perimap {

// By any name, link or hard link; also two names of one file that is not there yet. What is special is never the same:
// writing to it puts nothing away.
[[nodiscard]] bool is_same_file(const std::string& a, const std::string& b);

}  // namespace perimap
