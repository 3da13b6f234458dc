// The WebSocket of one page.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/web/page_message.hpp"

namespace perimap {

// A page that breaks the protocol, says too much or does not read is closed; what is sent to it then goes nowhere.
class PageSocket : public std::enable_shared_from_this<PageSocket> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  struct Events {
    std::function<void()> opened;
    std::function<Expected<void>(std::string_view)> said;
    std::function<void()> closed;  // once, whatever came before
  };

  // `command` is what serves.
  PageSocket(boost::beast::tcp_stream stream, std::string_view command, Events events);

  // `subprotocol` is named in the answer; empty: none is.
  void accept(const Request& request, const std::string& subprotocol);
  // Instead: accepts only to say why not, since a browser shows no page what a refusal says.
  void turn_away(const Request& request, const std::string& subprotocol, std::string_view why);

  void send(const PageMessage& message);
  // A message has been under way for too long.
  [[nodiscard]] bool stuck(Instant now) const noexcept;
  // Says that the server goes, after what waits still.
  void say_goodbye();
  // At once.
  void drop();

 private:
  using Stream = boost::beast::websocket::stream<boost::beast::tcp_stream>;

  void configure(const std::string& subprotocol);
  void read();
  void heard(std::size_t size);
  void write();
  void close(boost::beast::websocket::close_code code, std::string_view why);
  void finish_closing();
  void end();

  Stream stream_;
  const std::string command_;
  Events events_;
  boost::beast::flat_buffer buffer_;
  std::deque<PageMessage> waiting_;
  PageMessage writing_;
  Instant writing_since_;
  bool open_ = false;
  bool ended_ = false;
  bool busy_ = false;     // writing_ is under way
  bool closing_ = false;  // nothing more is taken to be sent
  bool finishing_ = false;
  boost::beast::websocket::close_reason reason_;
};

}  // namespace perimap
