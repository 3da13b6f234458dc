// Emulated ECG devices: the far end of drivers/ecg, speaking the real protocols.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "drivers/device/device_protocol.hpp"
#include "drivers/standins/emulator/ecg_device_signals.hpp"
#include "drivers/standins/emulator/emulator_faults.hpp"

namespace perimap {

// What they share: a clock of their own, which makes a sample due when the waveform has come to it.
class EcgEmulator : public DeviceProtocol {
 public:
  // `line_time`: what a sample takes on the device's own line. A pseudo-terminal takes none, so the device waits for
  // it.
  EcgEmulator(EcgDeviceSignals signals, double sample_rate_hz, Duration line_time, const EmulatorFaults& faults);

  void on_open(LinkControl& link, Instant now) final;
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) final;
  void on_time(LinkControl& link, Instant now) final;
  [[nodiscard]] Instant next_time() const noexcept final;

  // When sample `count` since the device's start is measured.
  [[nodiscard]] Instant due(std::int64_t count) const noexcept;

 protected:
  // A byte from the host.
  virtual void command(LinkControl& link, std::uint8_t byte) = 0;
  // What is measured at one instant; not a number while the lead or the sensor is off.
  struct Measured {
    float mV = 0.0F;
    std::optional<float> second_mV;  // where there is a second lead
    float respiration = 0.0F;        // from -1 to 1
  };
  // A sample is due.
  virtual void sample(LinkControl& link, const Measured& measured) = 0;

  void run(bool running, Instant now) noexcept;
  void set_line_time(Duration line_time) noexcept { line_time_ = line_time; }
  [[nodiscard]] FaultySender& sender() noexcept { return sender_; }
  [[nodiscard]] Instant now() const noexcept { return now_; }

 private:
  EcgDeviceSignals signals_;
  double period_ns_;
  Duration line_time_;
  EmulatorFaults faults_;
  FaultySender sender_;
  bool running_ = false;
  std::int64_t next_ = 0;
  Instant now_{};
};

// The ECG is on the input that the drivers take by default and, where there is a second lead, on the next; respiration,
// which a Medlab does not send, on all others. Faults take the first lead off, and leave the second.
[[nodiscard]] std::unique_ptr<EcgEmulator> emulate_medlab(EcgDeviceSignals signals, const EmulatorFaults& faults);
[[nodiscard]] std::unique_ptr<EcgEmulator> emulate_bitalino(EcgDeviceSignals signals, const EmulatorFaults& faults);
[[nodiscard]] std::unique_ptr<EcgEmulator> emulate_cyton(EcgDeviceSignals signals, const EmulatorFaults& faults);
// With that module, whose packets come in turn with the board's.
[[nodiscard]] std::unique_ptr<EcgEmulator> emulate_cyton_with_daisy(EcgDeviceSignals signals,
                                                                    const EmulatorFaults& faults);

}  // namespace perimap
