#include "daemon/process/stop_signal.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

namespace perimap {

Expected<StopSignal> StopSignal::install() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  const int error = pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  if (error != 0) {
    return fail(fmt::format("cannot block SIGINT and SIGTERM: {}", std::generic_category().message(error)));
  }
  const int descriptor = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  if (descriptor < 0) {
    return fail(fmt::format("cannot open a signal descriptor: {}", std::generic_category().message(errno)));
  }
  return StopSignal(descriptor);
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
      signalfd_siginfo info{};
      requested_ = read(descriptor_, &info, sizeof info) == static_cast<ssize_t>(sizeof info);
    }
    if (MonotonicClock::now() >= deadline) {
      break;
    }
  }
  return requested_;
}

}  // namespace perimap
