// Keeps a protocol connected to its device: opens, carries bytes both ways, closes, opens again.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/device/device_protocol.hpp"
#include "drivers/transport/byte_stream.hpp"
#include "drivers/transport/endpoint.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// One conversation over an open stream, until the protocol or the stream fails (the reason is returned) or the
// interrupt is requested (the text is then empty).
[[nodiscard]] std::string converse(ByteStream& stream, DeviceProtocol& protocol, const Interrupt& interrupt);

using StreamOpener = std::function<Expected<std::unique_ptr<ByteStream>>(const Interrupt&)>;

// A serial port at this rate, or a TCP connection, whose host is looked up by one thread at a time; a CAN endpoint is
// an error, since it carries frames.
[[nodiscard]] StreamOpener opener_of(const Endpoint& endpoint, int baud);

// Runs on the calling thread until interrupted. `health` tells the state and, when there is no link, the reason.
void serve_device(const StreamOpener& open, DeviceProtocol& protocol, DeviceHealth& health, const Interrupt& interrupt);

}  // namespace perimap
