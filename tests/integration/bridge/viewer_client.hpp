// A viewer of the Foxglove WebSocket protocol, written from its description and nothing of the bridge: it takes what
// comes, apart into operations (text) and messages of channels (binary).
#pragma once

#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "core/time/instant.hpp"

namespace perimap::test {

class ViewerClient {
 public:
  struct Message {
    std::uint32_t subscription = 0;
    Instant utc;
    std::string cdr;
  };
  // One of the two; neither: the connection has ended.
  struct Received {
    std::optional<nlohmann::json> operation;
    std::optional<Message> message;
  };

  explicit ViewerClient(std::uint16_t port) : port_(port) {}
  ViewerClient(const ViewerClient&) = delete;
  ViewerClient& operator=(const ViewerClient&) = delete;
  ~ViewerClient() {
    if (!thread_.joinable()) return;
    boost::system::error_code ignored;
    socket_.next_layer().shutdown(boost::asio::ip::tcp::socket::shutdown_both, ignored);
    thread_.join();
  }

  // Whether it was let in; empty: it names no subprotocol.
  [[nodiscard]] bool connect(const std::string& subprotocol) {
    namespace websocket = boost::beast::websocket;
    boost::system::error_code error;
    const boost::asio::ip::tcp::endpoint server(boost::asio::ip::make_address("127.0.0.1"), port_);
    socket_.next_layer().connect(server, error);
    if (error) return false;
    socket_.read_message_max(std::size_t{16} << 20U);
    websocket::response_type answer;
    socket_.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
      if (!subprotocol.empty()) request.set(boost::beast::http::field::sec_websocket_protocol, subprotocol);
    }));
    socket_.handshake(answer, "127.0.0.1:" + std::to_string(port_), "/", error);
    if (error) return false;
    EXPECT_EQ(answer[boost::beast::http::field::sec_websocket_protocol], subprotocol);
    thread_ = std::thread([this] { read(); });
    return true;
  }

  void say(const nlohmann::json& operation) {
    boost::system::error_code error;
    socket_.text(true);
    socket_.write(boost::asio::buffer(operation.dump()), error);
    EXPECT_FALSE(error) << error.message();
  }

  // Hands over what comes, in its order, until the function is content; false when it is not in that time.
  template <class Content>
  [[nodiscard]] bool until(Content content, Duration patience = std::chrono::minutes(2)) {
    const auto give_up = std::chrono::steady_clock::now() + patience;
    for (;;) {
      std::unique_lock lock(mutex_);
      if (!come_.wait_until(lock, give_up, [this] { return !received_.empty(); })) return false;
      const Received next = std::move(received_.front());
      received_.pop_front();
      lock.unlock();
      if (content(next)) return true;
      if (!next.operation && !next.message) return false;
    }
  }

 private:
  void read() {
    for (bool ended = false; !ended;) {
      boost::beast::flat_buffer buffer;
      boost::system::error_code error;
      socket_.read(buffer, error);
      const std::string bytes = boost::beast::buffers_to_string(buffer.data());
      ended = error.failed();
      Received received;
      if (!ended) received = socket_.got_text() ? operation_of(bytes) : message_of(bytes);
      const std::lock_guard lock(mutex_);
      received_.push_back(std::move(received));
      come_.notify_one();
    }
  }
  static Received operation_of(const std::string& bytes) {
    Received received;
    received.operation = nlohmann::json::parse(bytes, nullptr, false);
    EXPECT_TRUE(received.operation->is_object()) << bytes;
    return received;
  }
  // An operation's code, the subscription, the instant, all little-endian; and what the channel carries.
  static Received message_of(const std::string& bytes) {
    constexpr std::size_t kHead = 1 + 4 + 8;
    Received received;
    if (bytes.size() < kHead || bytes[0] != 1) {
      ADD_FAILURE() << bytes.size() << " bytes that are no message of a channel";
      received.operation = nlohmann::json::object();
      return received;
    }
    const auto number = [&](std::size_t at, std::size_t size) {
      std::uint64_t sum = 0;
      for (std::size_t i = 0; i < size; ++i) sum |= std::uint64_t{static_cast<unsigned char>(bytes[at + i])} << (8 * i);
      return sum;
    };
    received.message = {static_cast<std::uint32_t>(number(1, 4)), from_ns(static_cast<std::int64_t>(number(5, 8))),
                        bytes.substr(kHead)};
    return received;
  }

  std::uint16_t port_;
  boost::asio::io_context io_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> socket_{io_};
  std::mutex mutex_;
  std::condition_variable come_;
  std::deque<Received> received_;
  std::thread thread_;
};

}  // namespace perimap::test
