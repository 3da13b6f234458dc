// A protocol without its transport: what one end of a link does when bytes or instants come. The same shape serves the
// driver of a device and the emulator that stands in for it; tests and fuzzers call it with no device at all.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "core/time/instant.hpp"

namespace perimap {

// What a protocol may ask of its link.
class LinkControl {
 public:
  virtual ~LinkControl() = default;

  // Queued; goes out in this order.
  virtual void send(std::span<const std::byte> bytes) = 0;
  void send(std::string_view text) { send(std::as_bytes(std::span(text.data(), text.size()))); }
  // Of a serial line; nothing on another link.
  virtual void set_line_rate(int baud) = 0;
  // A line that cannot send one goes on without: the device's silence tells it, as that of one that did not hear it.
  virtual void send_break() = 0;
  // Closes the link, tells why, and has it opened anew. The first reason counts.
  virtual void fail(std::string reason) = 0;
  // Time that one byte takes on the wire, ns; 0 when it does not matter.
  [[nodiscard]] virtual double byte_time_ns() const noexcept { return 0.0; }
  // Whether the other end is reached over a serial line, where speed and break mean something.
  [[nodiscard]] virtual bool serial() const noexcept { return false; }
};

inline constexpr Instant kNever = Instant::max();

// Called by one thread.
class DeviceProtocol {
 public:
  virtual ~DeviceProtocol() = default;

  // The link is open; nothing is left of an earlier one.
  virtual void on_open(LinkControl& link, Instant now) = 0;
  // `arrival` is when the last of these bytes was there to be read.
  virtual void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) = 0;
  // At or after next_time().
  virtual void on_time(LinkControl& link, Instant now) = 0;
  [[nodiscard]] virtual Instant next_time() const noexcept = 0;
  // The link is closed.
  virtual void on_close() {}
};

}  // namespace perimap
