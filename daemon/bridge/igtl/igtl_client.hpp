// One client of the OpenIGTLink server.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "core/time/instant.hpp"
#include "daemon/bridge/igtl/igtl_messages.hpp"

namespace perimap {

// Of a stream the newest message alone waits to be sent. A client that has gone, or was dropped, gets nothing more.
class IgtlClient : public std::enable_shared_from_this<IgtlClient> {
 public:
  // `gone`: called once, whatever ended it.
  IgtlClient(boost::asio::ip::tcp::socket socket, std::function<void()> gone);

  void begin();
  void send(const IgtlOutgoing& message);
  // What waits of the subject is not sent.
  void forget(IgtlOutgoing::Subject subject);
  // Whether it does not read: a message has been under way for so long, its system has not taken in for so long what
  // was sent, or too many wait. To be asked regularly.
  [[nodiscard]] bool stuck(Instant now, Duration longest);
  [[nodiscard]] bool idle() const noexcept { return !busy_ && waiting_.empty(); }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  void drop();

 private:
  // So much had been written by then.
  struct Mark {
    Instant at;
    std::uint64_t written = 0;
  };

  void read();
  void write();

  boost::asio::ip::tcp::socket socket_;
  std::function<void()> gone_;
  std::string name_;  // its address
  std::array<char, 4096> heard_{};
  std::deque<IgtlOutgoing> waiting_;
  IgtlOutgoing writing_;
  Instant writing_since_;
  std::uint64_t written_ = 0;  // bytes, that the kernel has taken
  std::deque<Mark> marks_;     // of what the client's system has not
  bool busy_ = false;
  bool ended_ = false;
  bool too_many_ = false;
};

}  // namespace perimap
