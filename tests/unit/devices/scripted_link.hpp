// A link to nowhere that remembers what the protocol asked of it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "drivers/device/device_protocol.hpp"

namespace perimap {

class ScriptedLink final : public LinkControl {
 public:
  explicit ScriptedLink(bool is_serial = false) : serial_(is_serial) {}

  using LinkControl::send;
  void send(std::span<const std::byte> bytes) override {
    for (const std::byte b : bytes) sent.push_back(static_cast<char>(b));
  }
  void set_line_rate(int baud) override { rates.push_back(baud); }
  void send_break() override { ++breaks; }
  void fail(std::string reason) override {
    if (failure.empty()) failure = std::move(reason);
  }
  bool serial() const noexcept override { return serial_; }

  [[nodiscard]] std::string take_sent() { return std::exchange(sent, {}); }

  std::string sent;
  std::vector<int> rates;
  int breaks = 0;
  std::string failure;

 private:
  bool serial_;
};

}  // namespace perimap
