#include "drivers/transport/host_lookup.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

namespace perimap {
namespace {

HostAddresses owned(addrinfo* found) {
  return {found, [](addrinfo* list) { ::freeaddrinfo(list); }};
}

addrinfo hints_for_tcp(int flags) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV | flags;
  return hints;
}

// Of the calling thread, whatever it has inherited.
void leave_realtime() noexcept {
  const sched_param none{};
  (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &none);
}

}  // namespace

// Shared by who waits and by who looks up; the last of them puts it away.
struct HostLookup::Answer {
  Interrupt there;
  std::mutex mutex;  // of what follows, which is written before `there`
  int error = 0;
  HostAddresses addresses;
};

HostLookup::HostLookup(std::string host, std::uint16_t port, AddressSource source)
    : host_(std::move(host)),
      port_(fmt::format("{}", port)),
      name_(fmt::format("{}:{}", host_, port)),
      source_(std::move(source)) {}

Expected<void> HostLookup::ask() {
  const auto answer = std::make_shared<Answer>();
  const auto look_up = [answer, source = source_, host = host_, port = port_] {
    leave_realtime();
    const addrinfo hints = hints_for_tcp(AI_ADDRCONFIG);
    addrinfo* list = nullptr;
    const int error = source(host.c_str(), port.c_str(), &hints, &list);
    const std::lock_guard lock(answer->mutex);
    answer->error = error;
    if (error == 0) answer->addresses = owned(list);
    answer->there.request();
  };
  try {
    std::thread(look_up).detach();
  } catch (const std::system_error& error) {
    return fail(fmt::format("{}: cannot look it up: {}", name_, error.what()));
  }
  asked_ = answer;
  return {};
}

Expected<HostAddresses> HostLookup::addresses(Duration longest, const Interrupt& interrupt) {
  // Digits need no name server and no thread.
  const addrinfo digits = hints_for_tcp(AI_NUMERICHOST);
  addrinfo* found = nullptr;
  if (::getaddrinfo(host_.c_str(), port_.c_str(), &digits, &found) == 0) return owned(found);
  if (!asked_) {
    if (auto asking = ask(); !asking) return tl::unexpected(std::move(asking.error()));
  }

  const Instant deadline = MonotonicClock::now() + longest;
  for (;;) {
    const Duration left = std::max(deadline - MonotonicClock::now(), Duration(0));
    const std::timespec timeout{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
    std::array<pollfd, 2> waited{{{asked_->there.descriptor(), POLLIN, 0}, {interrupt.descriptor(), POLLIN, 0}}};
    const int ready = ::ppoll(waited.data(), waited.size(), &timeout, nullptr);
    if (ready < 0 && errno == EINTR) continue;
    if (waited[1].revents != 0) return fail(name_ + ": interrupted");
    if (waited[0].revents == 0) {
      return fail(
          fmt::format("{}: no answer from the name server within {:.1f} s; give the address in digits, or in "
                      "/etc/hosts",
                      name_, to_seconds(longest)));
    }
    const auto answer = std::exchange(asked_, nullptr);
    const std::lock_guard lock(answer->mutex);
    if (answer->error != 0) return fail(fmt::format("{}: unknown host: {}", name_, ::gai_strerror(answer->error)));
    return answer->addresses;
  }
}

}  // namespace perimap
