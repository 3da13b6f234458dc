#include "daemon/process/stop_signal.hpp"

#include <poll.h>

#include <algorithm>
#include <csignal>
#include <utility>

#include "daemon/process/signal_descriptor.hpp"

namespace perimap {

Expected<StopSignal> StopSignal::install() {
  return open_signal_descriptor({SIGINT, SIGTERM}).map([](Descriptor descriptor) {
    return StopSignal(std::move(descriptor));
  });
}

bool StopSignal::wait_for(Duration longest) noexcept {
  const Instant deadline = MonotonicClock::now() + longest;
  while (!requested_) {
    const Duration left = std::max(deadline - MonotonicClock::now(), Duration(0));
    const std::timespec timeout{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
    pollfd waited{descriptor_.get(), POLLIN, 0};
    if (ppoll(&waited, 1, &timeout, nullptr) > 0) {
      requested_ = take_signal(descriptor_.get());
    }
    if (MonotonicClock::now() >= deadline) {
      break;
    }
  }
  return requested_;
}

}  // namespace perimap
