// The unit of a table's times: seconds, unless somebody says otherwise; times that cannot be seconds are refused.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

enum class TimeUnit { kSecond, kMillisecond, kMicrosecond, kNanosecond };

// "s", "ms", "us", "ns"; none: another name.
[[nodiscard]] std::optional<TimeUnit> time_unit_named(std::string_view name) noexcept;

// `times` as they stand in the table, made seconds of in place; what is not finite is passed over. Without a unit they
// are taken for seconds, and refused in one line that begins with `name` and says which unit they look like when they
// span more than ten days, lie three thousand years away from zero, or are two hundred and more over four hours, five
// seconds and more apart: devices of a set-up measure for minutes, several times a second.
[[nodiscard]] Expected<void> make_seconds(std::vector<double>& times, std::optional<TimeUnit> unit,
                                          std::string_view name);

}  // namespace perimap
