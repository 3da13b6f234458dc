// How a command ends.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "core/error/expected.hpp"

namespace perimap {

// What a program tells whoever started it. Wrong usage is a wrong configuration, too.
enum class ExitCode : int { kDone = 0, kFailed = 1, kWrongUsage = 2 };

// `error`: without a message when all has been told already.
struct Refusal {
  Error error;
  ExitCode code = ExitCode::kFailed;
};

using Outcome = tl::expected<void, Refusal>;

[[nodiscard]] inline tl::unexpected<Refusal> refuse(Error error, ExitCode code = ExitCode::kFailed) {
  return tl::unexpected(Refusal{std::move(error), code});
}
[[nodiscard]] inline tl::unexpected<Refusal> refuse(std::string message, ExitCode code = ExitCode::kFailed) {
  return refuse(Error{std::move(message)}, code);
}

// Of an error that tells itself whether it is the configuration that is wrong.
template <class Setup>
requires requires(const Setup& setup) {
  setup.error;
  setup.configuration;
}
[[nodiscard]] tl::unexpected<Refusal> refuse(const Setup& setup) {
  return refuse(setup.error, setup.configuration ? ExitCode::kWrongUsage : ExitCode::kFailed);
}

}  // namespace perimap
