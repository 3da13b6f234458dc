#include "drivers/emulator/ecg_emulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/ecg/bitalino.hpp"
#include "drivers/ecg/cyton.hpp"
#include "drivers/ecg/medlab.hpp"

namespace perimap {
namespace {

class MedlabEmulator final : public EcgEmulator {
 public:
  MedlabEmulator(EcgWaveform waveform, const EmulatorFaults& faults)
      : EcgEmulator(std::move(waveform), MedlabProtocol::kSampleRate_hz, time_on_line(1, MedlabProtocol::kBaud),
                    faults) {}

 protected:
  // The module streams from power-up; its commands change what it already does.
  void command(LinkControl& /*link*/, std::uint8_t byte) override {
    if (byte != 'N') return;
    since_marker_ = kSamplesToMarker;
    run(true, now());
  }

  void sample(LinkControl& link, std::optional<float> mV) override {
    // Once a second a pulse, or that the lead is off, and then the wave marker; also when the one becomes the other.
    const bool off = !mV;
    const bool due = since_marker_ >= kSamplesToMarker || off != off_;
    if (due && off) put(link, {0xFB, 0x11, 0xF8});
    if (due && !off) put(link, {0xFA, 0x48, 0xF8});
    if (due) since_marker_ = 0;
    off_ = off;
    ++since_marker_;
    const double counts = 128.0 + mV.value_or(0.0F) / MedlabSettings{}.count_mV;
    const std::array<std::byte, 1> value{static_cast<std::byte>(std::lround(std::clamp(counts, 0.0, 246.0)))};
    sender().send(link, value, 0);
  }

 private:
  void put(LinkControl& link, const std::array<std::uint8_t, 3>& bytes) {
    sender().send(link, std::as_bytes(std::span(bytes)), 0);
  }

  static constexpr int kSamplesToMarker = 300;
  int since_marker_ = kSamplesToMarker;
  bool off_ = false;
};

class BitalinoEmulator final : public EcgEmulator {
 public:
  BitalinoEmulator(EcgWaveform waveform, const EmulatorFaults& faults)
      : EcgEmulator(std::move(waveform), BitalinoProtocol::kSampleRate_hz,
                    time_on_line(BitalinoProtocol::kFrameBytes, BitalinoProtocol::kBaud), faults) {}

 protected:
  void command(LinkControl& /*link*/, std::uint8_t byte) override {
    if (byte == 0x00) run(false, now());
    if ((byte & 0x03U) == 0x01U) run(true, now());
  }

  void sample(LinkControl& link, std::optional<float> mV) override {
    const double of_supply = mV ? 0.5 + *mV * 1100.0 / 3300.0 : 1.0;
    const auto value = static_cast<unsigned>(std::lround(std::clamp(1024.0 * of_supply, 0.0, 1023.0)));
    std::array<std::byte, BitalinoProtocol::kFrameBytes> frame{static_cast<std::byte>(value << 2U & 0xFFU),
                                                               static_cast<std::byte>(value >> 6U),
                                                               static_cast<std::byte>(sequence_ << 4U)};
    frame[2] |= static_cast<std::byte>(bitalino_crc(frame));
    sequence_ = (sequence_ + 1) % 16;
    sender().send(link, frame, 2);
  }

 private:
  unsigned sequence_ = 0;
};

class CytonEmulator final : public EcgEmulator {
 public:
  CytonEmulator(EcgWaveform waveform, const EmulatorFaults& faults)
      : EcgEmulator(std::move(waveform), CytonProtocol::kSampleRate_hz,
                    time_on_line(CytonProtocol::kPacketBytes, CytonProtocol::kBaud), faults) {}

 protected:
  void command(LinkControl& link, std::uint8_t byte) override {
    if (byte == 's') run(false, now());
    if (byte == 'b') run(true, now());
    if (byte == 'v') {
      run(false, now());
      link.send(std::string_view("OpenBCI V3 8-16 channel\nADS1299 Device ID: 0x3E\nFirmware: v3.1.2\n$$$"));
    }
  }

  void sample(LinkControl& link, std::optional<float> mV) override {
    std::array<std::byte, CytonProtocol::kPacketBytes> packet{};
    packet.front() = std::byte{0xA0};
    packet[1] = static_cast<std::byte>(count_++);
    const double scale = 0x7FFFFF * CytonSettings{}.gain / 4500.0;
    const double counts = mV ? *mV * scale : 0x7FFFFF;
    const auto value = static_cast<std::uint32_t>(std::lround(std::clamp(counts, -8388607.0, 8388607.0)));
    for (unsigned i = 0; i < 3; ++i) packet[2 + i] = static_cast<std::byte>(value >> (16U - 8U * i) & 0xFFU);
    packet.back() = std::byte{0xC0};
    sender().send(link, packet, 0);
  }

 private:
  std::uint8_t count_ = 0;
};

}  // namespace

EcgEmulator::EcgEmulator(EcgWaveform waveform, double sample_rate_hz, Duration line_time, const EmulatorFaults& faults)
    : waveform_(std::move(waveform)),
      period_ns_(1e9 / sample_rate_hz / (1.0 + 1e-6 * faults.drift_ppm)),
      line_time_(line_time),
      faults_(faults),
      sender_(faults) {}

Instant EcgEmulator::due(std::int64_t count) const noexcept {
  return waveform_.start() + Duration(std::llround(static_cast<double>(count) * period_ns_));
}

// A sample measured before now is not sent: the device measures while it runs.
void EcgEmulator::run(bool running, Instant now) noexcept {
  if (running && !running_) {
    const auto since = static_cast<double>((now - waveform_.start()).count());
    next_ = std::max(next_, static_cast<std::int64_t>(std::ceil(since / period_ns_)));
  }
  running_ = running;
}

void EcgEmulator::on_open(LinkControl& /*link*/, Instant now) {
  running_ = false;
  now_ = now;
}

void EcgEmulator::on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  now_ = arrival;
  for (const std::byte b : bytes) command(link, std::to_integer<std::uint8_t>(b));
}

void EcgEmulator::on_time(LinkControl& link, Instant now) {
  now_ = now;
  for (; running_ && due(next_) + line_time_ <= now; ++next_) {
    const Instant t = due(next_);
    const auto mV = waveform_.at(t);
    if (!mV) {
      running_ = false;  // played to its end
      return;
    }
    sample(link, faults_.missing(t - waveform_.start()) ? std::nullopt : mV);
  }
}

Instant EcgEmulator::next_time() const noexcept { return running_ ? due(next_) + line_time_ : kNever; }

std::unique_ptr<EcgEmulator> emulate_medlab(EcgWaveform waveform, const EmulatorFaults& faults) {
  return std::make_unique<MedlabEmulator>(std::move(waveform), faults);
}
std::unique_ptr<EcgEmulator> emulate_bitalino(EcgWaveform waveform, const EmulatorFaults& faults) {
  return std::make_unique<BitalinoEmulator>(std::move(waveform), faults);
}
std::unique_ptr<EcgEmulator> emulate_cyton(EcgWaveform waveform, const EmulatorFaults& faults) {
  return std::make_unique<CytonEmulator>(std::move(waveform), faults);
}

}  // namespace perimap
