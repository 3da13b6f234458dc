#include "drivers/standins/emulator/ecg_emulator.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/ecg/bitalino.hpp"
#include "drivers/ecg/cyton.hpp"
#include "drivers/ecg/medlab.hpp"

namespace perimap {
namespace {

class MedlabEmulator final : public EcgEmulator {
 public:
  MedlabEmulator(EcgDeviceSignals signals, const EmulatorFaults& faults)
      : EcgEmulator(std::move(signals), MedlabProtocol::kSampleRate_hz, time_on_line(1, MedlabProtocol::kBaud),
                    faults) {}

 protected:
  // The module streams from power-up; its commands change what it already does.
  void command(LinkControl& /*link*/, std::uint8_t byte) override {
    if (byte != 'N') return;
    since_marker_ = kSamplesToMarker;
    run(true, now());
  }

  void sample(LinkControl& link, const Measured& measured) override {
    const float mV = measured.mV;
    // Once a second a pulse, or that the lead is off, and then the wave marker; also when the one becomes the other.
    const bool off = std::isnan(mV);
    const bool due = since_marker_ >= kSamplesToMarker || off != off_;
    if (due && off) put(link, {0xFB, 0x11, 0xF8});
    if (due && !off) put(link, {0xFA, 0x48, 0xF8});
    if (due) since_marker_ = 0;
    off_ = off;
    ++since_marker_;
    const double counts = 128.0 + (off ? 0.0F : mV) / MedlabSettings{}.count_mV;
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
  BitalinoEmulator(EcgDeviceSignals signals, const EmulatorFaults& faults)
      : EcgEmulator(std::move(signals), BitalinoProtocol::kSampleRate_hz, line_time(1), faults) {}

 protected:
  void command(LinkControl& link, std::uint8_t byte) override {
    // One at a time: what follows too soon is not heard.
    if (now() - std::exchange(last_command_, now()) < kBetweenCommands) return;
    if (byte == 0x00) run(false, now());
    if (byte == 0x07) link.send(std::string_view("BITalino_v5.2\n"));
    if ((byte & 0x03U) != 0x01U) return;
    const unsigned mask = byte >> 2U;
    // Frames of more than three channels have another shape, which no driver asks for.
    const int channels = std::popcount(mask);
    if (channels < 1 || channels > 3) return;
    asked_ = mask;
    set_line_time(line_time(static_cast<std::size_t>(channels)));
    run(true, now());
  }

  void sample(LinkControl& link, const Measured& measured) override {
    std::array<unsigned, 3> values{};  // in order of input
    std::size_t channels = 0;
    for (int input = 1; input <= BitalinoProtocol::kChannels; ++input) {
      if ((asked_ >> static_cast<unsigned>(input - 1) & 1U) == 0U) continue;
      values[channels++] = counts_of(measured, input);
    }
    const auto byte = [](unsigned value) { return static_cast<std::byte>(value & 0xFFU); };
    std::array<std::byte, bitalino_frame_bytes(3)> bytes{byte(values[2] << 6U), byte(values[2] >> 2U),
                                                         byte(values[1]),       byte(values[0] << 2U | values[1] >> 8U),
                                                         byte(values[0] >> 6U), byte(sequence_ << 4U)};
    const std::span frame = std::span(bytes).last(bitalino_frame_bytes(channels));
    frame.back() |= static_cast<std::byte>(bitalino_crc(frame));
    sequence_ = (sequence_ + 1) % 16;
    sender().send(link, frame, frame.size() - 1);
  }

 private:
  static constexpr int kEcgInput = BitalinoSettings{}.channel;

  static unsigned counts_of(const Measured& measured, int input) {
    const auto ecg = [](float mV) { return counts(512.0 + 1024.0 * mV * 1100.0 / 3300.0); };
    if (input == kEcgInput) return ecg(measured.mV);
    if (input == kEcgInput + 1 && measured.second_mV) return ecg(*measured.second_mV);
    return counts(512.0 + 400.0 * measured.respiration);
  }
  static Duration line_time(std::size_t channels) {
    return time_on_line(bitalino_frame_bytes(channels), BitalinoProtocol::kBaud);
  }
  // An open input rests at the upper rail.
  static unsigned counts(double value) {
    return static_cast<unsigned>(std::lround(std::isnan(value) ? 1023.0 : std::clamp(value, 0.0, 1023.0)));
  }

  static constexpr Duration kBetweenCommands = std::chrono::milliseconds(50);

  Instant last_command_{};
  unsigned sequence_ = 0;
  unsigned asked_ = 0;  // inputs, the first in the lowest bit
};

class CytonEmulator final : public EcgEmulator {
 public:
  CytonEmulator(EcgDeviceSignals signals, const EmulatorFaults& faults, bool daisy)
      : EcgEmulator(std::move(signals), CytonProtocol::kSampleRate_hz,
                    time_on_line(CytonProtocol::kPacketBytes, CytonProtocol::kBaud), faults),
        daisy_(daisy) {}

 protected:
  void command(LinkControl& link, std::uint8_t byte) override {
    if (byte == 's') run(false, now());
    if (byte == 'b') run(true, now());
    if (byte == 'v') {
      run(false, now());
      link.send(std::string_view("OpenBCI V3 8-16 channel\nOn Board ADS1299 Device ID: 0x3E\n"));
      if (daisy_) link.send(std::string_view("On Daisy ADS1299 Device ID: 0x3E\n"));
      link.send(std::string_view("LIS3DH Device ID: 0x33\nFirmware: v3.1.2\n$$$"));
    }
  }

  void sample(LinkControl& link, const Measured& measured) override {
    std::array<std::byte, CytonProtocol::kPacketBytes> packet{};
    packet.front() = std::byte{0xA0};
    packet[1] = static_cast<std::byte>(count_++);
    for (int channel = 1; channel <= CytonProtocol::kChannels; ++channel) {
      // Packets of even numbers are the Daisy's, to which nothing is wired.
      const bool of_daisy = daisy_ && (count_ - 1) % 2 == 0;
      const float input_mV = of_daisy ? 0.0F : input(measured, channel);
      const std::size_t at = 2 + 3 * static_cast<std::size_t>(channel - 1);
      for (unsigned i = 0; i < 3; ++i) packet[at + i] = static_cast<std::byte>(counts(input_mV) >> (16U - 8U * i));
    }
    packet.back() = std::byte{0xC0};
    sender().send(link, packet, 0);
  }

 private:
  static float input(const Measured& measured, int channel) {
    if (channel == CytonSettings{}.channel) return measured.mV;
    if (channel == CytonSettings{}.channel + 1 && measured.second_mV) return *measured.second_mV;
    return measured.respiration;
  }
  // In its lowest 24 bits; an open input rests at the upper rail.
  static std::uint32_t counts(float mV) {
    constexpr double kFullScale = 0x7FFFFF;
    const double counts = mV * kFullScale * CytonSettings{}.gain / 4500.0;
    return static_cast<std::uint32_t>(
        std::lround(std::isnan(mV) ? kFullScale : std::clamp(counts, -kFullScale, kFullScale)));
  }

  bool daisy_;
  std::uint8_t count_ = 0;
};

}  // namespace

EcgEmulator::EcgEmulator(EcgDeviceSignals signals, double sample_rate_hz, Duration line_time,
                         const EmulatorFaults& faults)
    : signals_(std::move(signals)),
      period_ns_(1e9 / sample_rate_hz / (1.0 + 1e-6 * faults.drift_ppm)),
      line_time_(line_time),
      faults_(faults),
      sender_(faults) {}

Instant EcgEmulator::due(std::int64_t count) const noexcept {
  return signals_.ecg_mV.start() + Duration(std::llround(static_cast<double>(count) * period_ns_));
}

// A sample measured before now is not sent: the device measures while it runs.
void EcgEmulator::run(bool running, Instant now) noexcept {
  if (running && !running_) {
    const auto since = static_cast<double>((now - signals_.ecg_mV.start()).count());
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
    const auto mV = signals_.ecg_mV.at(t);
    if (!mV) {
      running_ = false;  // played to its end
      return;
    }
    const bool off = faults_.missing(t - signals_.ecg_mV.start());
    sample(link,
           {off ? std::numeric_limits<float>::quiet_NaN() : *mV, signals_.second_at(t), signals_.respiration_at(t)});
  }
}

Instant EcgEmulator::next_time() const noexcept { return running_ ? due(next_) + line_time_ : kNever; }

std::unique_ptr<EcgEmulator> emulate_medlab(EcgDeviceSignals signals, const EmulatorFaults& faults) {
  return std::make_unique<MedlabEmulator>(std::move(signals), faults);
}
std::unique_ptr<EcgEmulator> emulate_bitalino(EcgDeviceSignals signals, const EmulatorFaults& faults) {
  return std::make_unique<BitalinoEmulator>(std::move(signals), faults);
}
std::unique_ptr<EcgEmulator> emulate_cyton(EcgDeviceSignals signals, const EmulatorFaults& faults) {
  return std::make_unique<CytonEmulator>(std::move(signals), faults, false);
}
std::unique_ptr<EcgEmulator> emulate_cyton_with_daisy(EcgDeviceSignals signals, const EmulatorFaults& faults) {
  return std::make_unique<CytonEmulator>(std::move(signals), faults, true);
}

}  // namespace perimap
