// What a browser asks for: the target of an HTTP request, RFC 9112 section 3.2.1 (origin form alone).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"

namespace perimap {

inline constexpr std::size_t kLongestTarget = 256;

struct RequestTarget {
  std::string path;   // begins with '/'
  std::string token;  // of the query's `token=`; empty: none was given
};

// Any bytes are safe; an error is one printable line. A path has letters, digits and "/._-" alone: those of the page
// have no others, and no escape has to be understood.
[[nodiscard]] Expected<RequestTarget> parse_request_target(std::string_view target);

}  // namespace perimap
