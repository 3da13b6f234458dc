// What the serial ECG protocols share: starting, watching for silence, telling what is wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/device/device_protocol.hpp"
#include "drivers/device/rate_check.hpp"
#include "drivers/ecg/ecg_assembler.hpp"

namespace perimap {

// Of bytes on a serial line, 8N1.
[[nodiscard]] constexpr Duration time_on_line(std::size_t bytes, int baud) noexcept {
  return from_seconds(static_cast<double>(bytes) * 10.0 / baud);
}

// A device that says nothing for 300 ms is silent; after 2 s, and at the start after 2 s more than the start takes, the
// link is opened anew, because a device that was switched off has to be started again. So it is when samples come at
// another rate than the protocol's, which a device may not have been told; none is taken then until a second of them
// came at the right one, since stamps are made by it.
class EcgProtocol : public DeviceProtocol {
 public:
  // `transport_delay`: from a sample's measurement to the earliest that it can be here.
  EcgProtocol(double sample_rate_hz, Duration transport_delay, EcgSinks sinks, DeviceHealth& health);

  void on_open(LinkControl& link, Instant now) final;
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) final;
  void on_time(LinkControl& link, Instant now) final;
  [[nodiscard]] Instant next_time() const noexcept final;

 protected:
  // By send_in() and wait_longer() alone.
  virtual void start() = 0;
  // Some devices take one command at a time: this one goes out so long after the last, or after now if that has gone.
  // Until the first sample it is part of the start.
  void send_in(Duration pause, std::span<const std::byte> command);
  void send_in(Duration pause, std::string_view command) {
    send_in(pause, std::as_bytes(std::span(command.data(), command.size())));
  }
  // The device may take so much longer than others to answer the last of the start's commands.
  void wait_longer(Duration duration) noexcept { started_ += duration; }
  // Commands that have not gone out yet do not.
  void drop_commands() noexcept { commands_.clear(); }
  // Gives what the bytes hold to samples(). Bytes that fit nowhere are counted as damaged.
  virtual void decode(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) = 0;
  // Why the link is given up without a sample: `bytes` have come in `seconds`.
  [[nodiscard]] virtual std::string why_no_sample(std::uint64_t bytes, double seconds) const;

  [[nodiscard]] EcgAssembler& samples() noexcept { return samples_; }
  [[nodiscard]] DeviceHealth& health() noexcept { return health_; }

 private:
  EcgAssembler samples_;
  DeviceHealth& health_;
  struct Command {
    Instant due;
    std::vector<std::byte> bytes;
  };
  void send_due(LinkControl& link, Instant now);
  // Whether samples come at the rate that stamps are made by; gives the link up when they no longer do.
  bool expect_rate(LinkControl& link, Instant arrival);
  [[nodiscard]] std::string wrong_rate() const;

  double sample_rate_hz_;
  RateCheck rate_;
  bool refused_ = false;  // samples of this conversation, for their rate
  std::deque<Command> commands_;
  Instant now_{};
  Instant opened_{};
  Instant started_{};  // the last of the start's commands has gone, and what it takes has passed
  std::uint64_t bytes_ = 0;
};

}  // namespace perimap
