#include "drivers/transport/interrupt.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

namespace perimap {

Interrupt::Interrupt() : event_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!event_) throw std::system_error(errno, std::generic_category(), "eventfd");
}

void Interrupt::request() noexcept {
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the request is there already.
  [[maybe_unused]] const auto written = ::write(event_.get(), &one, sizeof one);
}

bool Interrupt::requested() const noexcept {
  pollfd waited{event_.get(), POLLIN, 0};
  return ::poll(&waited, 1, 0) > 0;
}

}  // namespace perimap
