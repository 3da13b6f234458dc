// What a running perimapd can be told: one line, and its answer.
//
// Request:  COMMAND "\n", at most kLongestRequest bytes.   Examples: "status\n", "new-patient\n", "record on\n"
// Answer:   "ok\n" or "error\n", then text up to the connection's end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"

namespace perimap {

inline constexpr std::size_t kLongestRequest = 64;

enum class ControlCommand : std::uint8_t { kStatus, kNewPatient, kOrganMoved, kRecordOn, kRecordOff, kReload };

[[nodiscard]] std::string_view name_of(ControlCommand command) noexcept;

// Of the whole request, its newline included. Any bytes are safe; an error is one printable line.
[[nodiscard]] Expected<ControlCommand> parse_control_request(std::string_view request);

}  // namespace perimap
