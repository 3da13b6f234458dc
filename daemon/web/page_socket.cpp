#include "daemon/web/page_socket.hpp"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/socket_base.hpp>
#include <utility>

namespace perimap {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

// Pages say which instant of a recording, or which channels they want.
constexpr std::size_t kMostSaidBytes = 4096;
// Messages that wait beside the replaceable ones: seconds of status.
constexpr std::size_t kMostWaiting = 64;
constexpr Duration kLongestWrite = std::chrono::seconds(5);
// What the kernel keeps for a page that reads slowly is old when it is read.
constexpr int kKernelBytes = 1 << 18;

}  // namespace

PageSocket::PageSocket(beast::tcp_stream stream, std::string_view command, Events events)
    : stream_(std::move(stream)), command_(command), events_(std::move(events)) {}

void PageSocket::configure(const std::string& subprotocol) {
  if (!subprotocol.empty()) {
    stream_.set_option(websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
      response.set(beast::http::field::sec_websocket_protocol, subprotocol);
    }));
  }
  // The WebSocket has time limits of its own.
  beast::get_lowest_layer(stream_).expires_never();
  error_code ignored;
  beast::get_lowest_layer(stream_).socket().set_option(boost::asio::socket_base::send_buffer_size(kKernelBytes),
                                                       ignored);
  beast::get_lowest_layer(stream_).socket().set_option(boost::asio::ip::tcp::no_delay(true), ignored);
  stream_.set_option(websocket::stream_base::timeout{std::chrono::seconds(5), std::chrono::seconds(10), true});
  stream_.read_message_max(kMostSaidBytes);
}

void PageSocket::accept(const Request& request, const std::string& subprotocol) {
  configure(subprotocol);
  stream_.async_accept(request, [self = shared_from_this()](error_code error) {
    if (error || self->ended_) return self->end();
    self->open_ = true;
    self->events_.opened();
    self->read();
    self->write();
  });
}

void PageSocket::turn_away(const Request& request, const std::string& subprotocol, std::string_view why) {
  configure(subprotocol);
  stream_.async_accept(request, [self = shared_from_this(), why = std::string(why)](error_code error) {
    if (error || self->ended_) return self->end();
    self->open_ = true;
    self->close(websocket::close_code::try_again_later, why);
  });
}

void PageSocket::read() {
  stream_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t size) {
    if (error) return self->end();
    self->heard(size);
  });
}

void PageSocket::heard(std::size_t size) {
  if (ended_) return;
  if (!closing_) {
    const auto bytes = beast::buffers_front(buffer_.data());
    const auto said = events_.said(std::string_view(static_cast<const char*>(bytes.data()), bytes.size()));
    if (!said) {
      waiting_.clear();
      close(websocket::close_code::policy_error, said.error().message);
    }
  }
  buffer_.consume(size);
  if (!ended_) read();  // also while closing: the other side's answer is read
}

void PageSocket::send(const PageMessage& message) {
  if (ended_ || closing_) return;
  if (message.lane != PageMessage::kNoLane) {
    const auto old = std::find_if(waiting_.begin(), waiting_.end(),
                                  [&message](const PageMessage& other) { return other.lane == message.lane; });
    if (old != waiting_.end()) waiting_.erase(old);
  }
  if (waiting_.size() >= kMostWaiting) return drop();
  waiting_.push_back(message);
  write();
}

void PageSocket::write() {
  if (!open_ || busy_ || ended_) return;
  if (waiting_.empty()) {
    if (closing_) finish_closing();
    return;
  }
  writing_ = std::move(waiting_.front());
  waiting_.pop_front();
  busy_ = true;
  writing_since_ = MonotonicClock::now();
  stream_.binary(writing_.binary);
  stream_.async_write(boost::asio::buffer(*writing_.bytes), [self = shared_from_this()](error_code error, std::size_t) {
    self->busy_ = false;
    if (error) return self->end();
    self->write();
  });
}

bool PageSocket::stuck(Instant now) const noexcept { return busy_ && now - writing_since_ > kLongestWrite; }

void PageSocket::say_goodbye() {
  if (!open_) return end();  // its beginning is being written still
  close(websocket::close_code::going_away, command_ + " has ended");
}

void PageSocket::close(websocket::close_code code, std::string_view why) {
  if (ended_ || closing_) return;
  closing_ = true;
  reason_ = websocket::close_reason(code);
  // A reason has at most 123 bytes, RFC 6455 section 5.5.
  const std::string_view told = why.substr(0, 120);
  reason_.reason.assign(told.data(), told.size());
  write();  // what waits, and is under way, goes first
}

void PageSocket::finish_closing() {
  if (std::exchange(finishing_, true)) return;
  stream_.async_close(reason_, [self = shared_from_this()](error_code) { self->end(); });
}

void PageSocket::drop() { end(); }

void PageSocket::end() {
  if (std::exchange(ended_, true)) return;
  error_code ignored;
  beast::get_lowest_layer(stream_).socket().close(ignored);
  waiting_.clear();
  if (events_.closed) events_.closed();
}

}  // namespace perimap
