#include "drivers/device/device_link.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "drivers/device/reopening.hpp"
#include "drivers/transport/host_lookup.hpp"
#include "drivers/transport/serial_port.hpp"
#include "drivers/transport/tcp_stream.hpp"

namespace perimap {
namespace {

constexpr Duration kLongestConnect = std::chrono::seconds(2);

std::timespec timeout_until(Instant deadline) {
  // A day is for ever, and safe from overflow.
  const Duration left =
      deadline == kNever ? Duration(std::chrono::hours(24)) : std::max(deadline - MonotonicClock::now(), Duration(0));
  return {left.count() / 1'000'000'000, left.count() % 1'000'000'000};
}

class StreamControl final : public LinkControl {
 public:
  explicit StreamControl(ByteStream& stream) : stream_(stream) {}

  using LinkControl::send;
  void send(std::span<const std::byte> bytes) override {
    outgoing_.insert(outgoing_.end(), bytes.begin(), bytes.end());
  }
  void set_line_rate(int baud) override {
    if (auto set = stream_.set_line_rate(baud); !set) fail(std::move(set.error().message));
  }
  void send_break() override { (void)stream_.send_break(); }
  void fail(std::string reason) override {
    if (!failure_) failure_ = std::move(reason);
  }
  double byte_time_ns() const noexcept override { return stream_.byte_time_ns(); }
  bool serial() const noexcept override { return stream_.byte_time_ns() > 0.0; }

  [[nodiscard]] const std::optional<std::string>& failure() const noexcept { return failure_; }
  [[nodiscard]] bool pending() const noexcept { return !outgoing_.empty(); }
  void flush() {
    auto put = stream_.write(outgoing_);
    if (!put) return fail(std::move(put.error().message));
    outgoing_.erase(outgoing_.begin(), outgoing_.begin() + static_cast<std::ptrdiff_t>(*put));
  }

 private:
  ByteStream& stream_;
  std::vector<std::byte> outgoing_;
  std::optional<std::string> failure_;
};

}  // namespace

std::string converse(ByteStream& stream, DeviceProtocol& protocol, const Interrupt& interrupt) {
  StreamControl control(stream);
  std::array<std::byte, 4096> buffer{};
  protocol.on_open(control, MonotonicClock::now());
  while (!control.failure()) {
    if (control.pending()) {
      control.flush();
      if (control.failure()) break;
    }
    const short events = static_cast<short>(control.pending() ? POLLIN | POLLOUT : POLLIN);
    std::array<pollfd, 2> waited{{{stream.descriptor(), events, 0}, {interrupt.descriptor(), POLLIN, 0}}};
    const std::timespec timeout = timeout_until(protocol.next_time());
    const int ready = ::ppoll(waited.data(), waited.size(), &timeout, nullptr);
    const Instant now = MonotonicClock::now();
    if (ready < 0 && errno != EINTR) return std::generic_category().message(errno);
    if (ready > 0 && waited[1].revents != 0) break;
    if (ready > 0 && (waited[0].revents & ~POLLOUT) != 0) {
      const auto got = stream.read(buffer);
      if (!got) {
        control.fail(got.error().message);
        break;
      }
      if (*got > 0) protocol.on_bytes(control, std::span(buffer).first(*got), now);
    }
    if (now >= protocol.next_time()) protocol.on_time(control, now);
  }
  protocol.on_close();
  return control.failure().value_or(std::string());
}

StreamOpener opener_of(const Endpoint& endpoint, int baud) {
  if (const auto* serial = std::get_if<SerialEndpoint>(&endpoint)) {
    return [path = serial->path, baud](const Interrupt&) { return open_serial_port(path, baud); };
  }
  if (const auto* tcp = std::get_if<TcpEndpoint>(&endpoint)) {
    return [to = std::make_shared<HostLookup>(tcp->host, tcp->port)](const Interrupt& interrupt) {
      return connect_tcp(*to, kLongestConnect, interrupt);
    };
  }
  return [name = format_endpoint(endpoint)](const Interrupt&) -> Expected<std::unique_ptr<ByteStream>> {
    return perimap::fail(name + ": carries CAN frames, expected a serial port or tcp:HOST:PORT");
  };
}

void serve_device(const StreamOpener& open, DeviceProtocol& protocol, DeviceHealth& health,
                  const Interrupt& interrupt) {
  serve_reopening([&] { return open(interrupt); },
                  [&](std::unique_ptr<ByteStream>& stream) { return converse(*stream, protocol, interrupt); }, health,
                  interrupt);
}

}  // namespace perimap
