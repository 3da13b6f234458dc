#include "daemon/bridge/igtl/igtl_client.hpp"

#include <fmt/format.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <utility>

namespace perimap {
namespace {

using boost::system::error_code;

// Changes of a state that wait: a client that has not taken so many does not read.
constexpr std::size_t kMostWaitingMessages = 64;
// What the kernel keeps for a client that reads slowly is old when it is read: little is kept on this side. How much
// the client's own system takes in for it cannot be told from here.
constexpr int kSendBytes = 1 << 14;
constexpr int kUnsentBytes = 1 << 12;

}  // namespace

IgtlClient::IgtlClient(boost::asio::ip::tcp::socket socket, std::function<void()> gone)
    : socket_(std::move(socket)), gone_(std::move(gone)) {
  error_code error;
  socket_.set_option(boost::asio::socket_base::send_buffer_size(kSendBytes), error);
  socket_.set_option(boost::asio::ip::tcp::no_delay(true), error);
  (void)setsockopt(socket_.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytes, sizeof kUnsentBytes);
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
  // What clears a surface is never refused.
  const bool room = waiting_.size() < kMostWaitingMessages || message.stream();
  if (room) waiting_.push_back(message);
  too_many_ = too_many_ || !room;
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
                           [self = shared_from_this()](error_code error, std::size_t size) {
                             self->busy_ = false;
                             self->written_ += size;
                             if (error) return self->drop();
                             self->write();
                           });
}

bool IgtlClient::stuck(Instant now, Duration longest) {
  int unread = 0;  // by the client's system
  if (ioctl(socket_.native_handle(), SIOCOUTQ, &unread) != 0) unread = 0;
  const std::uint64_t read =
      written_ - std::min<std::uint64_t>(static_cast<std::uint64_t>(std::max(unread, 0)), written_);
  while (!marks_.empty() && marks_.front().written <= read) marks_.pop_front();
  if (written_ > read && (marks_.empty() || marks_.back().written < written_)) marks_.push_back({now, written_});
  const bool not_taken = !marks_.empty() && now - marks_.front().at > longest;
  return too_many_ || not_taken || (busy_ && now - writing_since_ > longest);
}

void IgtlClient::drop() {
  if (std::exchange(ended_, true)) return;
  error_code ignored;
  socket_.close(ignored);
  waiting_.clear();
  if (gone_) gone_();
}

}  // namespace perimap
