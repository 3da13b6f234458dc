#include "daemon/process/reload_signal.hpp"

#include <poll.h>

#include <array>
#include <csignal>
#include <utility>

#include "daemon/process/signal_descriptor.hpp"

namespace perimap {

Expected<ReloadSignal> ReloadSignal::install() {
  return open_signal_descriptor({SIGHUP}).map(
      [](Descriptor descriptor) { return ReloadSignal(std::move(descriptor)); });
}

bool ReloadSignal::wait(int interrupt_descriptor) noexcept {
  for (;;) {
    std::array<pollfd, 2> waited{{{interrupt_descriptor, POLLIN, 0}, {descriptor_.get(), POLLIN, 0}}};
    if (poll(waited.data(), waited.size(), -1) <= 0) continue;
    if (waited[0].revents != 0) return false;
    if (take_signal(descriptor_.get())) return true;
  }
}

}  // namespace perimap
