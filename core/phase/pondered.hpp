// What a detector makes of an instant about which it has told no beat yet.
#pragma once

#include <cstdint>

namespace perimap {

enum class Pondered : std::uint8_t {
  kNothing,  // it has seen nothing there that is likely to be a beat
  kBeat,     // what is likely a beat, of a kind that it knows, and waits for what speaks against it
  kStranger  // what is likely a beat, but like none that it knows
};

}  // namespace perimap
