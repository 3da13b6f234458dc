#include "drivers/transport/tcp_stream.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

namespace perimap {
namespace {

class TcpStream final : public ByteStream {
 public:
  TcpStream(Descriptor descriptor, std::string name) : descriptor_(std::move(descriptor)), name_(std::move(name)) {}

  Expected<std::size_t> read(std::span<std::byte> buffer) override {
    return read_available(descriptor_.get(), buffer, name_.c_str());
  }
  Expected<std::size_t> write(std::span<const std::byte> bytes) override {
    if (bytes.empty()) return std::size_t{0};
    // send() and not write(): a peer that has gone must be an error here, not a SIGPIPE.
    const ssize_t put = ::send(descriptor_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (put >= 0) return static_cast<std::size_t>(put);
    if (errno == EAGAIN || errno == EINTR) return std::size_t{0};
    return fail(fmt::format("{}: cannot write: {}", name_, std::generic_category().message(errno)));
  }
  int descriptor() const noexcept override { return descriptor_.get(); }

 private:
  Descriptor descriptor_;
  std::string name_;
};

void set_option(int socket, int level, int option, int value) noexcept {
  (void)::setsockopt(socket, level, option, &value, sizeof value);
}

void prepare(int socket) noexcept {
  set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPIDLE, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPINTVL, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPCNT, 2);
}

std::string reason(int error, Duration longest) {
  switch (error) {
    case ECONNREFUSED:
      return "connection refused; nothing listens on this port";
    case EHOSTUNREACH:
    case ENETUNREACH:
      return "host unreachable; check cable, address and network";
    case ETIMEDOUT:
      return fmt::format("no answer within {:.1f} s; check address and firewall", to_seconds(longest));
    default:
      return std::generic_category().message(error);
  }
}

// 0, or the errno of what went wrong; ECANCELED when interrupted.
int finish_connecting(int socket, Duration longest, const Interrupt& interrupt) {
  const Instant deadline = MonotonicClock::now() + longest;
  for (;;) {
    const Duration left = std::max(deadline - MonotonicClock::now(), Duration(0));
    const std::timespec timeout{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
    std::array<pollfd, 2> waited{{{socket, POLLOUT, 0}, {interrupt.descriptor(), POLLIN, 0}}};
    const int ready = ::ppoll(waited.data(), waited.size(), &timeout, nullptr);
    if (ready < 0 && errno != EINTR) return errno;
    if (ready == 0) return ETIMEDOUT;
    if (ready > 0 && waited[1].revents != 0) return ECANCELED;
    if (ready > 0) {
      int error = 0;
      socklen_t size = sizeof error;
      return ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
    }
  }
}

}  // namespace

Expected<std::unique_ptr<ByteStream>> connect_tcp(HostLookup& host, Duration longest, const Interrupt& interrupt) {
  const auto addresses = host.addresses(longest, interrupt);
  if (!addresses) return tl::unexpected(addresses.error());
  int error = EHOSTUNREACH;
  for (const addrinfo* address = addresses->get(); address != nullptr; address = address->ai_next) {
    Descriptor socket(::socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (!socket) {
      error = errno;
      continue;
    }
    prepare(socket.get());
    error = ::connect(socket.get(), address->ai_addr, address->ai_addrlen) == 0 ? 0 : errno;
    if (error == EINPROGRESS) error = finish_connecting(socket.get(), longest, interrupt);
    if (error == 0) return std::make_unique<TcpStream>(std::move(socket), host.name());
    if (error == ECANCELED) break;
  }
  return fail(fmt::format("{}: {}", host.name(), reason(error, longest)));
}

Expected<TcpListener> TcpListener::open(std::uint16_t port) {
  const auto refuse = [port] {
    return fail(fmt::format("port {}: cannot listen: {}", port, std::generic_category().message(errno)));
  };
  Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket) return refuse();
  set_option(socket.get(), SOL_SOCKET, SO_REUSEADDR, 1);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  if (::bind(socket.get(), generic, size) != 0 || ::listen(socket.get(), 4) != 0 ||
      ::getsockname(socket.get(), generic, &size) != 0) {
    return refuse();
  }
  return TcpListener(std::move(socket), ntohs(address.sin_port));
}

Expected<std::unique_ptr<ByteStream>> TcpListener::accept() {
  Descriptor socket(::accept4(descriptor_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!socket) {
    if (errno == EAGAIN || errno == EINTR || errno == ECONNABORTED) return std::unique_ptr<ByteStream>();
    return fail(fmt::format("port {}: cannot accept: {}", port_, std::generic_category().message(errno)));
  }
  prepare(socket.get());
  return std::make_unique<TcpStream>(std::move(socket), fmt::format("client of port {}", port_));
}

}  // namespace perimap
