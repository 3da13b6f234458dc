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
using AddressSource = std::function<int(const char* host, const char* port, const addrinfo* hints, addrinfo** found)>;

// TCP addresses of a name, or of an address in digits. The name server is asked by a thread of its own, of the normal
// scheduler whoever asks, because a server that does not answer holds it for as long as it likes, and beyond the life
// of this object. There is one at a time: while it has no answer, asking again waits for the same one.
class HostLookup {
 public:
  HostLookup(std::string host, std::uint16_t port, AddressSource source = &::getaddrinfo);

  // Ends after `longest`, and at once when interrupted. One thread.
  //
  // Errors: unknown host, no answer from the name server, interrupted.
  [[nodiscard]] Expected<HostAddresses> addresses(Duration longest, const Interrupt& interrupt);

  // HOST:PORT.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  struct Answer;

  [[nodiscard]] Expected<void> ask();

  std::string host_;
  std::string port_;
  std::string name_;
  AddressSource source_;
  std::shared_ptr<Answer> asked_;  // and not taken yet; null: nobody is asked
};

}  // namespace perimap
