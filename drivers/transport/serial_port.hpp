// A serial line by termios: raw, 8N1, no handshake, ours alone while it is open.
#pragma once

#include <memory>
#include <string>

#include "core/error/expected.hpp"
#include "drivers/file/descriptor.hpp"
#include "drivers/transport/byte_stream.hpp"

namespace perimap {

// The line at `path`, open, non-blocking and ours alone; its settings are as they were.
//
// Errors name the path and what to do: no such device, no permission, in use by another program, no serial line.
[[nodiscard]] Expected<Descriptor> claim_serial_line(const std::string& path);
// Before a claimed line is closed: the mark outlives the descriptor while another program has the line open, and would
// lock us out ourselves.
void release_serial_line(const Descriptor& line) noexcept;
// A carrier that goes off is then no hang-up of the line.
[[nodiscard]] Expected<void> ignore_carrier(const Descriptor& line, const std::string& path);

// `path` may be a link, such as the stable names under /dev/serial/by-id. `baud` is a standard rate from 1200 to
// 4000000 or any other that the driver takes. Asks the driver for low latency (an FTDI adapter holds bytes back for 16
// ms otherwise); drivers without it go on as they are.
//
// Errors name the path and what to do: no such device, no permission, in use by another program, no serial line, a rate
// that the driver refuses.
[[nodiscard]] Expected<std::unique_ptr<ByteStream>> open_serial_port(const std::string& path, int baud);

}  // namespace perimap
