// The clients of an OpenIGTLink server: messages to all of them, over TCP, on one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/bridge/igtl/igtl_messages.hpp"

namespace perimap {

// A client gets the newest message of each subject when it connects, then each as it is sent. What a client says is
// read and means nothing.
class IgtlServer {
 public:
  static constexpr std::size_t kMostClients = 16;
  // A message that is under way for longer was not read: its client is dropped, and told of at the terminal.
  static constexpr Duration kLongestWrite = std::chrono::seconds(1);

  struct Settings {
    std::string address = "127.0.0.1";  // in numbers
    std::uint16_t port = 18944;         // 0: any that is free
  };
  // For a person at the terminal.
  using Say = std::function<void(const std::string&)>;

  // An error says which address it is, and what to do.
  [[nodiscard]] static Expected<IgtlServer> listen(const Settings& settings, Say say);
  IgtlServer(IgtlServer&&) noexcept;
  IgtlServer& operator=(IgtlServer&&) = delete;
  IgtlServer(const IgtlServer&) = delete;
  IgtlServer& operator=(const IgtlServer&) = delete;
  ~IgtlServer();

  // "ADDRESS:PORT" that clients connect to.
  [[nodiscard]] std::string endpoint() const;

  // Until the descriptor becomes readable (a StopSignal's) or end() was called. `ending` is called then, and what it
  // sends still goes out, for half a second at most.
  [[nodiscard]] Expected<void> run(int stop_descriptor, std::function<void()> ending);

  // From any thread: `work` is done on the server's, while it runs.
  void post(std::function<void()> work);

  // On the server's thread, or before it runs.
  void send(const IgtlOutgoing& message);
  // What was sent of the subject goes to nobody any more.
  void forget(IgtlOutgoing::Subject subject);
  // Calls `work` at that instant, unless another was set since.
  void at(Instant instant, std::function<void()> work);
  void end();

 private:
  class Impl;
  explicit IgtlServer(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace perimap
