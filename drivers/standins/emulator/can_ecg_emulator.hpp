// An emulated ECG module on a CAN interface.
#pragma once

#include <string>

#include "core/error/expected.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/standins/emulator/ecg_device_signals.hpp"
#include "drivers/standins/emulator/emulator_faults.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// Runs on the calling thread until interrupted or played to its end. Of the faults it knows lost frames, lead-off,
// drift and silence in place of unplugging. Respiration takes the place of every second sample: there are twice as many
// frames then.
[[nodiscard]] Expected<void> emulate_can_ecg(const std::string& interface_name, const EcgDeviceSignals& signals,
                                             const CanEcgSettings& settings, const EmulatorFaults& faults,
                                             const Interrupt& interrupt);

}  // namespace perimap
