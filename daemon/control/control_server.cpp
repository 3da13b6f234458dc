#include "daemon/control/control_server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <pwd.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

#include "core/error/one_line.hpp"
#include "core/time/instant.hpp"

namespace perimap {
namespace {

constexpr Duration kClientPatience = std::chrono::seconds(1);
constexpr Duration kAnswerPatience = std::chrono::seconds(10);
constexpr std::size_t kLongestAnswer = std::size_t{1} << 20;
constexpr std::string_view kOk = "ok\n";
constexpr std::string_view kError = "error\n";

std::string system_message(int error) { return std::generic_category().message(error); }

std::optional<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return std::nullopt;
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

int connect_to(const Descriptor& socket, const sockaddr_un& address) {
  return connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

// Whether `events` came before `until` and before the interrupt.
bool ready(int descriptor, short events, Instant until, const Interrupt* interrupt) {
  for (;;) {
    const Duration left = until - MonotonicClock::now();
    if (left <= Duration(0)) return false;
    std::array<pollfd, 2> waited{
        {{descriptor, events, 0}, {interrupt != nullptr ? interrupt->descriptor() : -1, POLLIN, 0}}};
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(left).count() + 1;
    const int n = poll(waited.data(), waited.size(), static_cast<int>(ms));
    if (waited[1].revents != 0) return false;
    if (n > 0) return true;
    if (n < 0 && errno != EINTR) return false;
  }
}

bool send_all(const Descriptor& socket, std::string_view bytes, Instant until, const Interrupt* interrupt) {
  while (!bytes.empty()) {
    const ssize_t sent = send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    } else if ((errno != EAGAIN && errno != EINTR) || !ready(socket.get(), POLLOUT, until, interrupt)) {
      return false;
    }
  }
  return true;
}

// What comes until `enough`, the end of the connection or the end of patience.
template <class Enough>
std::string receive(const Descriptor& socket, std::size_t longest, Instant until, const Interrupt* interrupt,
                    const Enough& enough) {
  std::string bytes;
  std::array<char, 4096> chunk{};
  while (!enough(bytes) && bytes.size() < longest && ready(socket.get(), POLLIN, until, interrupt)) {
    const ssize_t got = recv(socket.get(), chunk.data(), std::min(chunk.size(), longest - bytes.size()), MSG_DONTWAIT);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) break;
    if (got > 0) bytes.append(chunk.data(), static_cast<std::size_t>(got));
  }
  return bytes;
}

std::string peer_of(const Descriptor& client) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(client.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return "a peer that is not known";
  std::array<char, 4096> names{};
  passwd entry{};
  passwd* found = nullptr;
  const bool named = getpwuid_r(peer.uid, &entry, names.data(), names.size(), &found) == 0 && found != nullptr;
  return fmt::format("user {} ({}), group {}, process {}", peer.uid, named ? entry.pw_name : "no name", peer.gid,
                     peer.pid);
}

}  // namespace

Expected<ControlServer> ControlServer::create(const std::string& path, Answer answer) {
  const auto refused = [&path](std::string_view what, int error) {
    return fail(fmt::format("{}: cannot {}: {}", path, what, system_message(error)));
  };
  const std::optional<sockaddr_un> address = address_of(path);
  if (!address)
    return fail(fmt::format("{}: expected a socket's name of 1 to {} bytes", path, sizeof sockaddr_un{}.sun_path - 1));
  Descriptor listener(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!listener) return refused("open a socket", errno);
  struct stat there {};
  if (lstat(path.c_str(), &there) == 0 && S_ISSOCK(there.st_mode)) {
    const Descriptor probe(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (connect_to(probe, *address) == 0 || errno != ECONNREFUSED) {
      return fail(fmt::format("{}: another process takes commands there", path));
    }
    unlink(path.c_str());
  }
  if (bind(listener.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0) {
    return refused("take commands", errno);
  }
  // Until now the service's umask lets nobody else in.
  if (chmod(path.c_str(), S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP) != 0) return refused("set the mode", errno);
  if (listen(listener.get(), 4) != 0) return refused("listen", errno);
  return ControlServer(std::move(listener), path, std::move(answer));
}

ControlServer::~ControlServer() {
  if (listener_) unlink(path_.c_str());
}

void ControlServer::serve(const Interrupt& interrupt) {
  while (!interrupt.requested()) {
    std::array<pollfd, 2> waited{{{listener_.get(), POLLIN, 0}, {interrupt.descriptor(), POLLIN, 0}}};
    if (poll(waited.data(), waited.size(), -1) <= 0 || waited[0].revents == 0) continue;
    const Descriptor client(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (client) serve_client(client, interrupt);
  }
}

void ControlServer::serve_client(const Descriptor& client, const Interrupt& interrupt) {
  const std::string peer = peer_of(client);
  const std::string request = receive(client, kLongestRequest + 1, MonotonicClock::now() + kClientPatience, &interrupt,
                                      [](const std::string& bytes) { return bytes.find('\n') != std::string::npos; });
  const Expected<ControlCommand> command = parse_control_request(request);
  Expected<std::string> answer = command ? answer_(*command) : tl::unexpected(command.error());
  if (answer) {
    spdlog::info("command {} from {}: done", name_of(*command), peer);
  } else {
    spdlog::warn("command {} from {}: refused: {}", command ? name_of(*command) : "that is none", peer,
                 on_one_line(answer.error().message));
  }
  const std::string text =
      answer ? fmt::format("{}{}", kOk, *answer) : fmt::format("{}{}\n", kError, answer.error().message);
  static_cast<void>(send_all(client, text, MonotonicClock::now() + kClientPatience, &interrupt));
}

Expected<std::string> ask_control(const std::string& path, const std::string& command) {
  const std::optional<sockaddr_un> address = address_of(path);
  if (!address) return fail(fmt::format("'{}': expected the name of perimapd's socket", path));
  const Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!socket || connect_to(socket, *address) != 0) {
    return fail(fmt::format("{}: no perimapd takes commands there: {}", path, system_message(errno)));
  }
  const Instant until = MonotonicClock::now() + kAnswerPatience;
  if (!send_all(socket, command + "\n", until, nullptr))
    return fail(fmt::format("{}: the command was not taken", path));
  const std::string answer = receive(socket, kLongestAnswer, until, nullptr, [](const std::string&) { return false; });
  if (answer.starts_with(kOk)) return answer.substr(kOk.size());
  if (answer.starts_with(kError)) {
    std::string message = answer.substr(kError.size());
    while (message.ends_with('\n')) message.pop_back();
    return fail(std::move(message));
  }
  return fail(fmt::format("{}: the answer is none of perimapd's", path));
}

}  // namespace perimap
