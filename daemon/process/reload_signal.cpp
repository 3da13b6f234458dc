#include "daemon/process/reload_signal.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <utility>

#include "daemon/process/signal_descriptor.hpp"

namespace perimap {

Expected<ReloadSignal> ReloadSignal::install() {
  return open_signal_descriptor({SIGHUP}).map([](int descriptor) { return ReloadSignal(descriptor); });
}

ReloadSignal::ReloadSignal(ReloadSignal&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

ReloadSignal::~ReloadSignal() {
  if (descriptor_ >= 0) close(descriptor_);
}

bool ReloadSignal::wait(int interrupt_descriptor) noexcept {
  for (;;) {
    std::array<pollfd, 2> waited{{{interrupt_descriptor, POLLIN, 0}, {descriptor_, POLLIN, 0}}};
    if (poll(waited.data(), waited.size(), -1) <= 0) continue;
    if (waited[0].revents != 0) return false;
    if (take_signal(descriptor_)) return true;
  }
}

}  // namespace perimap
