#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace perimap {

// JSON as text, of values that paths, file names and devices went into: those may be any bytes, and what is no UTF-8
// stands there as U+FFFD. nlohmann's own dump() throws at it.

// On many lines, indented by two, the last with its end.
template <class Json>
std::string json_document(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// On one line, without its end.
template <class Json>
std::string json_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace perimap
