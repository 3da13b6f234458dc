// A link to nowhere that remembers what the protocol asked of it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "drivers/device/device_protocol.hpp"

namespace perimap {

// When a test of a protocol begins.
inline const Instant kStart(std::chrono::seconds(100));

class ScriptedLink final : public LinkControl {
 public:
  // `baud`: of a serial line whose bytes take their time; 0: they take none.
  explicit ScriptedLink(bool is_serial = false, int baud = 0) : serial_(is_serial), baud_(baud) {}

  using LinkControl::send;
  void send(std::span<const std::byte> bytes) override {
    for (const std::byte b : bytes) sent.push_back(static_cast<char>(b));
  }
  void set_line_rate(int baud) override {
    rates.push_back(baud);
    if (baud_ > 0) baud_ = baud;
  }
  void send_break() override { ++breaks; }
  void fail(std::string reason) override {
    if (failure.empty()) failure = std::move(reason);
  }
  bool serial() const noexcept override { return serial_; }
  double byte_time_ns() const noexcept override { return baud_ > 0 ? 10.0e9 / baud_ : 0.0; }

  [[nodiscard]] int baud() const noexcept { return baud_; }
  [[nodiscard]] std::string take_sent() { return std::exchange(sent, {}); }

  std::string sent;
  std::vector<int> rates;
  int breaks = 0;
  std::string failure;

 private:
  bool serial_;
  int baud_;
};

}  // namespace perimap
