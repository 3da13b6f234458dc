#include "drivers/ecg/can_ecg.hpp"

#include <fmt/format.h>
#include <linux/can/error.h>
#include <poll.h>

#include <array>
#include <cmath>
#include <string>

#include "drivers/device/reopening.hpp"

namespace perimap {
namespace {

constexpr unsigned kCountModulus = 256;
// Eight bytes of data in a standard frame are 111 bits before stuffing, at the usual 500 kbit/s.
constexpr Duration kFrameTime = std::chrono::microseconds(222);
constexpr Duration kSilentAfter = std::chrono::milliseconds(300);

// What a controller's error frame tells a user (linux/can/error.h); empty when the count alone says enough.
std::string explain_error(const CanFrame& frame) {
  constexpr unsigned kOverflow = CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW;
  constexpr unsigned kPassive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;
  if ((frame.identifier & CAN_ERR_BUSOFF) != 0) {
    return "the CAN controller has gone off the bus: is its bit rate right, its line closed at both ends?";
  }
  if ((frame.identifier & CAN_ERR_CRTL) == 0 || frame.length < 2) return "";
  const unsigned controller = frame.data[1];
  if ((controller & kOverflow) != 0) {
    return "the CAN controller's buffer has run over: frames were lost before the kernel had them";
  }
  if ((controller & kPassive) != 0) {
    return "the CAN controller is error-passive: many frames on the bus are damaged; cable, closing resistors, bit "
           "rate?";
  }
  return "";
}

// Until the socket fails (the reason is returned) or the interrupt is requested (empty then).
std::string read_frames(CanSocket& socket, CanEcgDecoder& decoder, const Interrupt& interrupt) {
  for (;;) {
    std::array<pollfd, 2> waited{{{socket.descriptor(), POLLIN, 0}, {interrupt.descriptor(), POLLIN, 0}}};
    constexpr int kSilent_ms = 300;
    (void)::poll(waited.data(), waited.size(), kSilent_ms);
    if (waited[1].revents != 0) return "";
    const auto frame = socket.receive();
    if (!frame) return frame.error().message;
    if (*frame) decoder.decode_frame(**frame);
    decoder.watch(MonotonicClock::now());
  }
}

}  // namespace

CanEcgDecoder::CanEcgDecoder(const CanEcgSettings& settings, EcgSinks sinks, DeviceHealth& health)
    : settings_(settings),
      samples_({.period_ns = 1e9 / settings.sample_rate_hz, .transport_delay = kFrameTime}, std::move(sinks), health),
      health_(health),
      rate_(settings.sample_rate_hz) {
  // A bus of another bit rate, and one on which others talk, is as silent as none.
  health_.set_awaited(fmt::format(
      "frames of config/perimap_ecg.dbc with the {}-bit identifier 0x{:0{}X} are awaited; are the bit rate, "
      "the identifier and the module right?",
      settings.extended ? 29 : 11, settings.identifier, settings.extended ? 8 : 3));
}

void CanEcgDecoder::restart() noexcept {
  samples_.restart();
  rate_.restart();
  rate_refused_ = false;  // what is still wrong is told again
  last_.reset();
  dropped_ = 0;
}

void CanEcgDecoder::watch(Instant now) noexcept {
  const std::uint64_t samples = health_.samples.get();
  if (samples != watched_samples_) {
    watched_samples_ = samples;
    health_.set_state(DeviceState::kStreaming);
  } else if (health_.state() == DeviceState::kStreaming && now - samples_.last_arrival() > kSilentAfter) {
    health_.set_state(DeviceState::kSilent);
  }
}

std::uint64_t CanEcgDecoder::lost_before(const CanEcgFrame& ecg, Instant arrival) const noexcept {
  if (!last_) return 0;
  const auto frames = static_cast<std::uint8_t>(ecg.count - last_->count - 1);
  const auto passed_ms = static_cast<std::uint16_t>(ecg.device_time_ms - last_->device_time_ms);
  // Those that were lost are taken to hold as many samples as the last.
  const int each = last_->samples;
  const double samples = passed_ms * 1e-3 * settings_.sample_rate_hz - each;
  // The device's time decides how often the count went round while it is not ambiguous itself.
  constexpr Duration kTimeWraps = std::chrono::seconds(60);
  if (arrival - last_arrival_ < kTimeWraps) {
    const double rounds = std::round((samples / each - frames) / kCountModulus);
    return static_cast<std::uint64_t>(each) *
           (frames + kCountModulus * static_cast<std::uint64_t>(std::max(0.0, rounds)));
  }
  return samples_.lost_samples(static_cast<std::uint64_t>(each) * frames,
                               static_cast<std::uint64_t>(each) * kCountModulus, 0, arrival);
}

bool CanEcgDecoder::expect_rate(Instant arrival) {
  rate_.observe(device_count_, arrival);
  if (rate_.wrong() == rate_refused_) return !rate_refused_;
  rate_refused_ = rate_.wrong();
  samples_.restart();
  health_.set_reason(rate_refused_ ? fmt::format("{:.1f} samples come a second, and can_sample_rate_hz says {:.1f}: "
                                                 "none can be stamped",
                                                 rate_.seen_hz(), settings_.sample_rate_hz)
                                   : "");
  return !rate_refused_;
}

void CanEcgDecoder::decode_frame(const CanFrame& frame) {
  health_.dropped.add(frame.dropped_before - dropped_);
  dropped_ = frame.dropped_before;
  if (frame.error) {
    health_.bus_errors.add();
    const std::string what = explain_error(frame);
    if (!what.empty()) health_.set_reason(what);
    return;
  }
  const auto ecg = decode_can_ecg(frame, settings_.identifier, settings_.extended);
  if (!ecg) {
    health_.damaged.add();
    return;
  }
  // The same frame again, as a bridge may send it.
  if (last_ && ecg->count == last_->count && ecg->device_time_ms == last_->device_time_ms) {
    health_.damaged.add();
    return;
  }
  const std::uint64_t lost = lost_before(*ecg, frame.arrival);
  last_ = ecg;
  last_arrival_ = frame.arrival;
  device_count_ += static_cast<std::int64_t>(lost) + ecg->samples;
  if (!expect_rate(frame.arrival)) return;
  std::optional<RespirationReading> respiration;
  if (ecg->respiration) respiration = {static_cast<float>(ecg->values[1]), ecg->respiration_off};
  for (int i = 0; i < ecg->samples; ++i) {
    const auto value = ecg->values[static_cast<std::size_t>(i)];
    samples_.add(static_cast<float>(value * settings_.count_mV), ecg->lead_off, i == 0 ? lost : 0, respiration);
  }
  samples_.end_chunk(frame.arrival);
}

void serve_can_ecg(const std::string& interface_name, const CanEcgSettings& settings, const EcgSinks& sinks,
                   DeviceHealth& health, const Interrupt& interrupt) {
  CanEcgDecoder decoder(settings, sinks, health);
  const auto open = [&] { return CanSocket::open(interface_name, settings.identifier, settings.extended); };
  const auto use = [&](CanSocket& socket) {
    decoder.restart();
    return read_frames(socket, decoder, interrupt);
  };
  serve_reopening(open, use, health, interrupt);
}

}  // namespace perimap
