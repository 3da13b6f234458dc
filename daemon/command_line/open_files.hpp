// How many files a program may have open at a time.
#pragma once

#include "core/error/expected.hpp"

namespace perimap {

// What perimapd with all devices and DDS has open at a time, and half as many again. With less, libraries fail in ways
// of their own (Cyclone DDS 0.10 reads through a null pointer when it can open no socket).
inline constexpr unsigned kOpenFiles = 64;

// Asks for as many where the limit is lower and may be raised. Error: the limit, and what was expected.
[[nodiscard]] Expected<void> ensure_open_files(unsigned least = kOpenFiles);

}  // namespace perimap
