#include "drivers/ecg/ecg_protocol.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>

namespace perimap {
namespace {

constexpr Duration kSilentAfter = std::chrono::milliseconds(300);
constexpr Duration kReopenAfter = std::chrono::seconds(2);

}  // namespace

EcgProtocol::EcgProtocol(double sample_rate_hz, Duration transport_delay, EcgSinks sinks, DeviceHealth& health)
    : samples_({.period_ns = 1e9 / sample_rate_hz, .transport_delay = transport_delay}, std::move(sinks), health),
      health_(health) {}

void EcgProtocol::on_open(LinkControl& link, Instant now) {
  samples_.restart();
  opened_ = now;
  bytes_ = 0;
  start(link);
}

void EcgProtocol::on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  bytes_ += bytes.size();
  const std::uint64_t before = health_.samples.get();
  decode(link, bytes, arrival);
  samples_.end_chunk(arrival);
  if (health_.samples.get() != before) health_.set_state(DeviceState::kStreaming);
}

Instant EcgProtocol::next_time() const noexcept {
  if (!samples_.any()) return opened_ + kReopenAfter;
  return samples_.last_arrival() + (health_.state() == DeviceState::kStreaming ? kSilentAfter : kReopenAfter);
}

void EcgProtocol::on_time(LinkControl& link, Instant now) {
  if (samples_.any()) {
    health_.set_state(DeviceState::kSilent);
    if (now - samples_.last_arrival() >= kReopenAfter) link.fail("no sample for 2 s; switched off or cable out?");
    return;
  }
  if (now - opened_ < kReopenAfter) return;
  link.fail(
      bytes_ == 0
          ? std::string("open, but not a byte in 2 s; switched off, or the wrong port?")
          : fmt::format("{} bytes in 2 s and not one sample among them; wrong baud rate or another device?", bytes_));
}

}  // namespace perimap
