// An emulated device that a test unplugs, plugs in again and silences.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "core/time/instant.hpp"
#include "drivers/device/device_protocol.hpp"
#include "drivers/standins/emulator/emulator_server.hpp"
#include "drivers/transport/endpoint.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap::test {

// A device that sends nothing while it is silenced; its link stays.
class SilencedDevice final : public DeviceProtocol {
 public:
  explicit SilencedDevice(std::unique_ptr<DeviceProtocol> device) : device_(std::move(device)) {}

  void silence(bool silent) noexcept { silent_ = silent; }

  void on_open(LinkControl& link, Instant now) override {
    Muffler muffler(link, silent_);
    device_->on_open(muffler, now);
  }
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) override {
    Muffler muffler(link, silent_);
    device_->on_bytes(muffler, bytes, arrival);
  }
  void on_time(LinkControl& link, Instant now) override {
    Muffler muffler(link, silent_);
    device_->on_time(muffler, now);
  }
  [[nodiscard]] Instant next_time() const noexcept override { return device_->next_time(); }
  void on_close() override { device_->on_close(); }

 private:
  class Muffler final : public LinkControl {
   public:
    Muffler(LinkControl& link, bool silent) : link_(link), silent_(silent) {}

    void send(std::span<const std::byte> bytes) override {
      if (!silent_) link_.send(bytes);
    }
    void set_line_rate(int baud) override { link_.set_line_rate(baud); }
    void send_break() override { link_.send_break(); }
    void fail(std::string reason) override { link_.fail(std::move(reason)); }
    [[nodiscard]] double byte_time_ns() const noexcept override { return link_.byte_time_ns(); }
    [[nodiscard]] bool serial() const noexcept override { return link_.serial(); }

   private:
    LinkControl& link_;
    bool silent_;
  };

  std::unique_ptr<DeviceProtocol> device_;
  std::atomic<bool> silent_{false};
};

class PluggedDevice {
 public:
  // `where`: a link to a pseudo-terminal, or a TCP port of this host. Not plugged in yet.
  PluggedDevice(std::unique_ptr<DeviceProtocol> device, Endpoint where)
      : device_(std::move(device)), where_(std::move(where)) {}
  PluggedDevice(const PluggedDevice&) = delete;
  PluggedDevice& operator=(const PluggedDevice&) = delete;
  ~PluggedDevice() {
    if (interrupt_) (void)unplug();
  }

  // When it was there, or a little before.
  Instant plug() {
    const Instant begun = MonotonicClock::now();
    interrupt_.emplace();
    there_ = false;
    thread_ = std::jthread([this] {
      const auto ready = [this](const std::string& /*where*/) {
        there_ = true;
        there_.notify_one();
      };
      const auto* tcp = std::get_if<TcpEndpoint>(&where_);
      const auto served =
          tcp != nullptr ? emulate_on_tcp(tcp->port, device_, {}, ready, *interrupt_)
                         : emulate_on_terminal(std::get<SerialEndpoint>(where_).path, device_, {}, ready, *interrupt_);
      EXPECT_TRUE(served) << served.error().message;
      ready("");
    });
    there_.wait(false);
    return begun;
  }
  // When its line was cut, or a little before.
  Instant unplug() {
    const Instant cut = MonotonicClock::now();
    interrupt_->request();
    thread_.join();
    interrupt_.reset();
    return cut;
  }
  Instant silence(bool silent) {
    device_.silence(silent);
    return MonotonicClock::now();
  }

 private:
  SilencedDevice device_;
  Endpoint where_;
  std::optional<Interrupt> interrupt_;
  std::atomic<bool> there_{false};
  std::jthread thread_;
};

}  // namespace perimap::test
