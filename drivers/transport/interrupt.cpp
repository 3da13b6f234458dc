#include "drivers/transport/interrupt.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <ctime>
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

bool wait_unless_interrupted(Duration longest, const Interrupt& interrupt) {
  const auto left_ns = std::max(longest, Duration(0)).count();
  const std::timespec timeout{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  pollfd waited{interrupt.descriptor(), POLLIN, 0};
  (void)::ppoll(&waited, 1, &timeout, nullptr);
  return !interrupt.requested();
}

}  // namespace perimap
