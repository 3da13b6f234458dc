#include "drivers/standins/emulator/emulator_server.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/device/device_link.hpp"
#include "drivers/transport/pseudo_terminal.hpp"
#include "drivers/transport/tcp_stream.hpp"

namespace perimap {
namespace {

// The device as it is, until it is unplugged.
class PluggedIn final : public DeviceProtocol {
 public:
  PluggedIn(DeviceProtocol& device, Instant until) : device_(device), until_(until) {}

  void on_open(LinkControl& link, Instant now) override { device_.on_open(link, now); }
  void on_bytes(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) override {
    device_.on_bytes(link, bytes, arrival);
  }
  void on_time(LinkControl& link, Instant now) override {
    if (now >= device_.next_time()) device_.on_time(link, now);
    if (now >= until_) link.fail("unplugged");
  }
  Instant next_time() const noexcept override { return std::min(device_.next_time(), until_); }
  void on_close() override { device_.on_close(); }

 private:
  DeviceProtocol& device_;
  Instant until_;
};

Instant unplugged_at(const EmulatorFaults& faults) {
  return faults.unplug_every > Duration(0) ? MonotonicClock::now() + faults.unplug_every : kNever;
}

// False at `until` and when interrupted.
bool wait_for_client(const TcpListener& listener, Instant until, const Interrupt& interrupt) {
  const Duration left = until == kNever ? Duration(std::chrono::hours(24)) : until - MonotonicClock::now();
  if (left <= Duration(0)) return false;
  const std::timespec timeout{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
  std::array<pollfd, 2> waited{{{listener.descriptor(), POLLIN, 0}, {interrupt.descriptor(), POLLIN, 0}}};
  return ::ppoll(waited.data(), waited.size(), &timeout, nullptr) > 0 && waited[1].revents == 0;
}

}  // namespace

Expected<void> emulate_on_terminal(const std::string& link, DeviceProtocol& device, const EmulatorFaults& faults,
                                   const EmulatorReady& ready, const Interrupt& interrupt) {
  while (!interrupt.requested()) {
    auto terminal = PseudoTerminal::open(link);
    if (!terminal) return tl::unexpected(std::move(terminal.error()));
    ready((*terminal)->path());
    PluggedIn plugged(device, unplugged_at(faults));
    (void)converse(**terminal, plugged, interrupt);
    terminal->reset();
    wait_unless_interrupted(faults.unplug_for, interrupt);
  }
  return {};
}

Expected<void> emulate_on_tcp(std::uint16_t port, DeviceProtocol& device, const EmulatorFaults& faults,
                              const EmulatorReady& ready, const Interrupt& interrupt) {
  while (!interrupt.requested()) {
    auto listener = TcpListener::open(port);
    if (!listener) return tl::unexpected(std::move(listener.error()));
    port = listener->port();
    ready(fmt::format("tcp:127.0.0.1:{}", port));
    const Instant until = unplugged_at(faults);
    while (wait_for_client(*listener, until, interrupt)) {
      auto client = listener->accept();
      if (!client) return tl::unexpected(std::move(client.error()));
      if (!*client) continue;
      PluggedIn plugged(device, until);
      (void)converse(**client, plugged, interrupt);
    }
    if (until == kNever) continue;
    listener = fail("unplugged");  // the port refuses until the device is plugged in again
    wait_unless_interrupted(faults.unplug_for, interrupt);
  }
  return {};
}

}  // namespace perimap
