// What every parser's error has in common.
#pragma once

#include <cstdlib>
#include <string>

namespace perimap::fuzz {

// Returns whether `result` is a value; aborts where it is an error of more than one line, which a log would tear apart.
template <class Result>
bool is_value(const Result& result) {
  if (!result && result.error().message.find_first_of("\r\n") != std::string::npos) std::abort();
  return static_cast<bool>(result);
}

}  // namespace perimap::fuzz
