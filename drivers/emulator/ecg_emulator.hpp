// Emulated ECG devices: the far end of drivers/ecg, speaking the real protocols.
#pragma once

#include <memory>
#include <vector>

#include "drivers/device/device_protocol.hpp"
#include "drivers/emulator/ecg_waveform.hpp"
#include "drivers/emulator/emulator_faults.hpp"

namespace perimap {

// What they share: a clock of their own, which makes a sample due when the waveform has come to it.
class EcgEmulator : public DeviceProtocol {
 public:
  // `line_time`: what a sample takes on the device's own line. A pseudo-terminal takes none, so the device waits for
  // it.
  EcgEmulator(EcgWaveform waveform, double sample_rate_hz, Duration line_time, const EmulatorFaults& faults);

  void on_open(LinkControl& link, Instant now) final;
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) final;
  void on_time(LinkControl& link, Instant now) final;
  [[nodiscard]] Instant next_time() const noexcept final;

  // When sample `count` since the device's start is measured.
  [[nodiscard]] Instant due(std::int64_t count) const noexcept;

 protected:
  // A byte from the host.
  virtual void command(LinkControl& link, std::uint8_t byte) = 0;
  // A sample is due; `none` while the lead is off.
  virtual void sample(LinkControl& link, std::optional<float> mV) = 0;

  void run(bool running, Instant now) noexcept;
  [[nodiscard]] FaultySender& sender() noexcept { return sender_; }
  [[nodiscard]] Instant now() const noexcept { return now_; }

 private:
  EcgWaveform waveform_;
  double period_ns_;
  Duration line_time_;
  EmulatorFaults faults_;
  FaultySender sender_;
  bool running_ = false;
  std::int64_t next_ = 0;
  Instant now_{};
};

[[nodiscard]] std::unique_ptr<EcgEmulator> emulate_medlab(EcgWaveform waveform, const EmulatorFaults& faults);
[[nodiscard]] std::unique_ptr<EcgEmulator> emulate_bitalino(EcgWaveform waveform, const EmulatorFaults& faults);
[[nodiscard]] std::unique_ptr<EcgEmulator> emulate_cyton(EcgWaveform waveform, const EmulatorFaults& faults);

}  // namespace perimap
