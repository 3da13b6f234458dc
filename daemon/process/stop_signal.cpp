#include "daemon/process/stop_signal.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <utility>

#include "daemon/process/signal_descriptor.hpp"

namespace perimap {

Expected<StopSignal> StopSignal::install() {
  return open_signal_descriptor({SIGINT, SIGTERM}).map([](int descriptor) { return StopSignal(descriptor); });
}

StopSignal::StopSignal(StopSignal&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), requested_(other.requested_) {}

StopSignal::~StopSignal() {
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
}

bool StopSignal::wait_for(Duration longest) noexcept {
  const Instant deadline = MonotonicClock::now() + longest;
  while (!requested_) {
    const Duration left = std::max(deadline - MonotonicClock::now(), Duration(0));
    const std::timespec timeout{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
    pollfd waited{descriptor_, POLLIN, 0};
    if (ppoll(&waited, 1, &timeout, nullptr) > 0) {
      requested_ = take_signal(descriptor_);
    }
    if (MonotonicClock::now() >= deadline) {
      break;
    }
  }
  return requested_;
}

}  // namespace perimap
