// Takes commands on a Unix-domain socket, from this host alone and only from whom the socket's group allows.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/control/control_request.hpp"
#include "drivers/file/descriptor.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// One client at a time; one that says nothing for a second is sent away. Every command is logged with who sent it, as
// the kernel knows it (SO_PEERCRED, unix(7)), and what came of it.
class ControlServer {
 public:
  // The text of the answer; an error's message is answered as an error.
  using Answer = std::function<Expected<std::string>(ControlCommand)>;

  // Binds the socket with mode 0660. One that was left by a process that is gone is replaced; errors name the path.
  [[nodiscard]] static Expected<ControlServer> create(const std::string& path, Answer answer);

  ControlServer(ControlServer&&) noexcept = default;
  ControlServer& operator=(ControlServer&&) = delete;
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  ~ControlServer();

  // Serves on the calling thread until interrupted.
  void serve(const Interrupt& interrupt);

 private:
  ControlServer(Descriptor listener, std::string path, Answer answer)
      : listener_(std::move(listener)), path_(std::move(path)), answer_(std::move(answer)) {}

  void serve_client(const Descriptor& client, const Interrupt& interrupt);

  Descriptor listener_;
  std::string path_;
  Answer answer_;
};

// The client's side: sends the request (a newline is added) and gives the answer's text. An error that the daemon
// answers is its message.
[[nodiscard]] Expected<std::string> ask_control(const std::string& path, const std::string& command);

}  // namespace perimap
