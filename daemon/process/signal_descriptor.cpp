#include "daemon/process/signal_descriptor.hpp"

#include <fmt/format.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>

namespace perimap {

Expected<Descriptor> open_signal_descriptor(std::initializer_list<int> signals) {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : signals) sigaddset(&set, signal);
  const int error = pthread_sigmask(SIG_BLOCK, &set, nullptr);
  if (error != 0) return fail(fmt::format("cannot block signals: {}", std::generic_category().message(error)));
  Descriptor descriptor(signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK));
  if (!descriptor) {
    return fail(fmt::format("cannot open a signal descriptor: {}", std::generic_category().message(errno)));
  }
  return descriptor;
}

bool take_signal(int descriptor) noexcept {
  signalfd_siginfo info{};
  return read(descriptor, &info, sizeof info) == static_cast<ssize_t>(sizeof info);
}

}  // namespace perimap
