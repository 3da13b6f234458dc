#pragma once

#include <cstdint>

namespace perimap {

// In what numbers estimates are held.
enum class Precision : std::uint8_t {
  kDouble,
  kSingle  // half the memory and twice the features an instruction
};

}  // namespace perimap
