// The inputs of a serial port beside its data, on one of which a monitor's R trigger comes.
#pragma once

#include <cstdint>

namespace perimap {

enum class ModemLine : std::uint8_t { kCarrierDetect, kClearToSend, kDataSetReady, kRingIndicator };

}  // namespace perimap
