// An error that tells whose fault it is.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "core/error/expected.hpp"

namespace perimap {

// `configuration`: what was asked for is wrong, the configuration or the options, and not what was read or measured. It
// becomes another exit code (command_line/outcome.hpp).
struct SetupError {
  Error error;
  bool configuration = false;

  SetupError() = default;
  // An error is of what was read unless someone says otherwise.
  SetupError(Error what, bool of_configuration = false)  // NOLINT(google-explicit-constructor)
      : error(std::move(what)), configuration(of_configuration) {}
};

template <class T>
using SetupExpected = tl::expected<T, SetupError>;

[[nodiscard]] inline tl::unexpected<SetupError> wrong_setup(Error error) {
  return tl::unexpected(SetupError(std::move(error), true));
}
[[nodiscard]] inline tl::unexpected<SetupError> wrong_setup(std::string message) {
  return wrong_setup(Error{std::move(message)});
}

}  // namespace perimap
