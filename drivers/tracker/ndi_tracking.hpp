// Tracking data of NDI's Combined API, from the replies to BX, BX2 and TX (guides as in ndi_reply.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/tracker/tool_reading.hpp"

namespace perimap {

struct NdiToolReading {
  std::uint16_t handle = 0;
  std::uint32_t frame = 0;  // the device's count; 0 with a disabled tool, which has none
  ToolReading reading;
};

struct NdiTracking {
  std::vector<NdiToolReading> tools;
  std::uint16_t system_status = 0;  // BX2 has none
};

// BX with reply option 0801: transforms, also of tools out of volume.
//   count u8; per handle: id u8, status u8 (1 valid, 2 missing, 4 disabled); valid: q0 qx qy qz tx ty tz error f32, mm;
//   valid or missing: port status u32, frame u32; at the end: system status u16
[[nodiscard]] Expected<NdiTracking> decode_bx(std::span<const std::byte> body);

// BX2 --6d=tools: a container (version u16, count u16) of components (type u16, size u32 with these 12 bytes, option
// u16, items u32). Frames (type 1) hold items of type u8, sequence u8, status u16, frame u32, time s u32 and ns u32 and
// a container; in there 6D data (type 2): handle u16, status u16 (bit 8 missing, low byte a code), floats as in BX
// unless missing. Other components are passed over by their size.
[[nodiscard]] Expected<NdiTracking> decode_bx2(std::span<const std::byte> body);

// TX with reply option 0801:
//   count 2 hex; per handle: id 2 hex; 4 x 6 (10^-4), 3 x 7 (10^-2 mm), 6 (10^-4 mm) signed digits, or MISSING,
//   DISABLED, UNOCCUPIED; port status 8 hex, frame 8 hex, LF; at the end: system status 4 hex
[[nodiscard]] Expected<NdiTracking> decode_tx(std::string_view text);

}  // namespace perimap
