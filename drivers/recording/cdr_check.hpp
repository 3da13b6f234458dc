// Whether bytes are one valid sample of a type: what must be known before Cyclone's reader may touch them.
//
// Cyclone DDS 0.10.2 has a check of its own, dds_stream_normalize, but in XCDR2 it takes an 8-byte element for 4 bytes
// (its alignment), so that a garbled sequence of doubles passes and is then read beyond the end of the buffer.
#pragma once

#include <dds/ddsc/dds_public_impl.h>

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/error/expected.hpp"

namespace perimap {

// `body` is XCDR2, little-endian, without its encapsulation header; `ops` the instructions that idlc made for the type
// (dds/ddsc/dds_opcodes.h). Returns the length of the sample, which may be less than that of the body. Fails with "at
// byte N of the body" where something does not fit: lengths, string terminators, enumerators, booleans, or a member
// that must be understood and is not known.
//
// Knows what the project's types are made of: numbers, booleans, enumerations of 4 bytes, strings, structs of every
// extensibility, arrays of numbers, sequences of numbers and of structs. Anything else is refused.
[[nodiscard]] Expected<std::size_t> check_xcdr2(std::span<const std::byte> body, const std::uint32_t* ops);

}  // namespace perimap
