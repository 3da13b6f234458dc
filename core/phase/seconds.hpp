// Real-valued durations, for arithmetic that must not round to whole nanoseconds.
#pragma once

#include <chrono>

namespace perimap {

using Seconds = std::chrono::duration<double>;

}  // namespace perimap
