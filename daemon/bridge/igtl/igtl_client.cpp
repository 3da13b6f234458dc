#include "daemon/bridge/igtl/igtl_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <utility>

namespace perimap {
namespace {

using boost::system::error_code;

// Changes of a state that wait: a client that has not taken so many does not read.
constexpr std::size_t kMostWaitingMessages = 64;
// What the kernel keeps for a client that reads slowly is old when it is read.
constexpr int kSendBytes = 1 << 17;

}  // namespace

IgtlClient::IgtlClient(boost::asio::ip::tcp::socket socket, std::function<void()> gone)
    : socket_(std::move(socket)), gone_(std::move(gone)) {
  error_code error;
  socket_.set_option(boost::asio::socket_base::send_buffer_size(kSendBytes), error);
  socket_.set_option(boost::asio::ip::tcp::no_delay(true), error);
  const auto remote = socket_.remote_endpoint(error);
  name_ = error ? "a client" : fmt::format("{} port {}", remote.address().to_string(), remote.port());
}

void IgtlClient::begin() { read(); }

void IgtlClient::read() {
  socket_.async_read_some(boost::asio::buffer(heard_), [self = shared_from_this()](error_code error, std::size_t) {
    if (error) return self->drop();
    self->read();
  });
}

void IgtlClient::send(const IgtlOutgoing& message) {
  if (ended_) return;
  if (message.stream()) forget(message.subject);
  too_many_ = waiting_.size() >= kMostWaitingMessages;
  if (!too_many_) waiting_.push_back(message);
  write();
}

void IgtlClient::forget(IgtlOutgoing::Subject subject) {
  std::erase_if(waiting_, [subject](const IgtlOutgoing& old) { return old.subject == subject; });
}

void IgtlClient::write() {
  if (busy_ || ended_ || waiting_.empty()) return;
  writing_ = std::move(waiting_.front());
  waiting_.pop_front();
  busy_ = true;
  writing_since_ = MonotonicClock::now();
  boost::asio::async_write(socket_, boost::asio::buffer(*writing_.bytes),
                           [self = shared_from_this()](error_code error, std::size_t) {
                             self->busy_ = false;
                             if (error) return self->drop();
                             self->write();
                           });
}

bool IgtlClient::stuck(Instant now, Duration longest) const noexcept {
  return too_many_ || (busy_ && now - writing_since_ > longest);
}

void IgtlClient::drop() {
  if (std::exchange(ended_, true)) return;
  error_code ignored;
  socket_.close(ignored);
  waiting_.clear();
  if (gone_) gone_();
}

}  // namespace perimap
