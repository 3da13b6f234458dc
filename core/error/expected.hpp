// The one error type that crosses boundaries: a sentence that names what was wrong and where.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace perimap {

struct Error {
  std::string message;  // one line, no trailing period, names file, line, key or byte where there is one
};

template <class T>
using Expected = tl::expected<T, Error>;

[[nodiscard]] inline tl::unexpected<Error> fail(std::string message) {
  return tl::unexpected<Error>(Error{std::move(message)});
}

}  // namespace perimap
