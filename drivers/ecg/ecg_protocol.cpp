#include "drivers/ecg/ecg_protocol.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

namespace perimap {
namespace {

constexpr Duration kSilentAfter = std::chrono::milliseconds(300);
constexpr Duration kReopenAfter = std::chrono::seconds(2);

}  // namespace

EcgProtocol::EcgProtocol(double sample_rate_hz, Duration transport_delay, EcgSinks sinks, DeviceHealth& health)
    : samples_({.period_ns = 1e9 / sample_rate_hz, .transport_delay = transport_delay}, std::move(sinks), health),
      health_(health),
      sample_rate_hz_(sample_rate_hz),
      rate_(sample_rate_hz) {}

void EcgProtocol::on_open(LinkControl& link, Instant now) {
  samples_.restart();
  rate_.restart();
  refused_ = false;
  opened_ = now;
  now_ = now;
  bytes_ = 0;
  commands_.clear();
  started_ = now;
  start();
  send_due(link, now);
}

void EcgProtocol::send_in(Duration pause, std::span<const std::byte> command) {
  const Instant from = commands_.empty() ? now_ : commands_.back().due;
  commands_.push_back({from + pause, {command.begin(), command.end()}});
  started_ = commands_.back().due;
}

void EcgProtocol::send_due(LinkControl& link, Instant now) {
  for (; !commands_.empty() && commands_.front().due <= now; commands_.pop_front()) link.send(commands_.front().bytes);
}

void EcgProtocol::on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) {
  now_ = arrival;
  bytes_ += bytes.size();
  const std::uint64_t before = health_.samples.get();
  const std::int64_t count = samples_.next_count();
  decode(link, bytes, arrival);
  // Bytes without a sample say nothing of the rate.
  if (samples_.next_count() != count && !expect_rate(link, arrival)) {
    refused_ = true;
    samples_.restart();
    return;
  }
  samples_.end_chunk(arrival);
  if (health_.samples.get() != before) health_.set_state(DeviceState::kStreaming);
}

bool EcgProtocol::expect_rate(LinkControl& link, Instant arrival) {
  const bool was_wrong = rate_.wrong();
  rate_.observe(samples_.next_count(), arrival);
  if (!rate_.wrong()) {
    if (was_wrong) health_.set_reason("");
    return true;
  }
  // What an earlier conversation has found is given time to become right in this one.
  if (!was_wrong) link.fail(wrong_rate());
  return false;
}

std::string EcgProtocol::wrong_rate() const {
  return fmt::format(
      "{:.1f} samples come a second, and the protocol has {:g}: none can be stamped; was the command that sets the "
      "rate lost, or does the line lose bytes?",
      rate_.seen_hz(), sample_rate_hz_);
}

Instant EcgProtocol::next_time() const noexcept {
  const Instant command = commands_.empty() ? kNever : commands_.front().due;
  if (!samples_.any()) return std::min(command, started_ + kReopenAfter);
  return std::min(command,
                  samples_.last_arrival() + (health_.state() == DeviceState::kStreaming ? kSilentAfter : kReopenAfter));
}

void EcgProtocol::on_time(LinkControl& link, Instant now) {
  now_ = now;
  send_due(link, now);
  if (samples_.any()) {
    if (now - samples_.last_arrival() < kSilentAfter) return;
    health_.set_state(DeviceState::kSilent);
    if (now - samples_.last_arrival() >= kReopenAfter) link.fail("no sample for 2 s; switched off or cable out?");
    return;
  }
  if (now < started_ + kReopenAfter) return;
  link.fail(refused_ ? wrong_rate() : why_no_sample(bytes_, to_seconds(now - opened_)));
}

std::string EcgProtocol::why_no_sample(std::uint64_t bytes, double seconds) const {
  if (bytes == 0) return fmt::format("open, but not a byte in {:.1f} s; switched off, or the wrong port?", seconds);
  return fmt::format("{} bytes in {:.1f} s and not one sample among them; wrong baud rate or another device?", bytes,
                     seconds);
}

}  // namespace perimap
