// Times as the page gets them.
#pragma once

#include <cstdint>

namespace perimap {

// Nanoseconds, of a clock or a duration, as milliseconds. Of a clock that has run for less than a hundred days they are
// right to the nanosecond.
[[nodiscard]] constexpr double page_ms(std::int64_t ns) noexcept { return static_cast<double>(ns) * 1e-6; }

}  // namespace perimap
