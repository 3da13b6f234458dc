// TCP: the connection to a device, and the listening side that emulators use.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/transport/byte_stream.hpp"
#include "drivers/transport/host_lookup.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// Waits at most `longest` for the name server and then for the connection, less when interrupted. No Nagle delay;
// keep-alive probes after 1 s of silence, so that a peer that vanished without a word is noticed in about 3 s.
//
// Errors name host, port and reason: unknown host, no name server, refused (nothing listens there), unreachable, no
// answer.
[[nodiscard]] Expected<std::unique_ptr<ByteStream>> connect_tcp(HostLookup& host, Duration longest,
                                                                const Interrupt& interrupt);

class TcpListener {
 public:
  // On the loopback interface; port 0 lets the kernel choose.
  [[nodiscard]] static Expected<TcpListener> open(std::uint16_t port);

  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  [[nodiscard]] int descriptor() const noexcept { return descriptor_.get(); }
  // The waiting connection, or null when there is none.
  [[nodiscard]] Expected<std::unique_ptr<ByteStream>> accept();

 private:
  TcpListener(Descriptor descriptor, std::uint16_t port) : descriptor_(std::move(descriptor)), port_(port) {}

  Descriptor descriptor_;
  std::uint16_t port_;
};

}  // namespace perimap
