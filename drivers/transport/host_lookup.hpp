// The addresses of a host, by a look-up that does not hold up who waits for it.
#pragma once

#include <netdb.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

using HostAddresses = std::shared_ptr<const addrinfo>;  // a list; never null

// getaddrinfo(3), or what a test puts in its place.
using HostLookup = std::function<int(const char* host, const char* port, const addrinfo* hints, addrinfo** found)>;

// TCP addresses of a name, or of an address in digits. A name server that does not answer is waited for by a thread
// that outlives this call: the call itself ends after `longest`, and at once when interrupted.
//
// Errors: unknown host, no answer from the name server, interrupted.
[[nodiscard]] Expected<HostAddresses> look_up_host(const std::string& host, std::uint16_t port, Duration longest,
                                                   const Interrupt& interrupt,
                                                   const HostLookup& lookup = &::getaddrinfo);

}  // namespace perimap
