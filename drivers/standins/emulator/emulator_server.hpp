// Puts an emulated device on a line: a pseudo-terminal or a TCP port, unplugged and plugged in again on request.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/error/expected.hpp"
#include "drivers/device/device_protocol.hpp"
#include "drivers/standins/emulator/emulator_faults.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// Told whenever the device is there: the name of the port, or host and port.
using EmulatorReady = std::function<void(const std::string& where)>;

// Run on the calling thread until interrupted; errors are those of opening the line for the first time. A TCP device
// serves one client at a time. `faults` says when the line is cut.
[[nodiscard]] Expected<void> emulate_on_terminal(const std::string& link, DeviceProtocol& device,
                                                 const EmulatorFaults& faults, const EmulatorReady& ready,
                                                 const Interrupt& interrupt);
[[nodiscard]] Expected<void> emulate_on_tcp(std::uint16_t port, DeviceProtocol& device, const EmulatorFaults& faults,
                                            const EmulatorReady& ready, const Interrupt& interrupt);

}  // namespace perimap
