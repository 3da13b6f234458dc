#include "daemon/web/web_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/view/page/view_page.hpp"

namespace perimap {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using testing::HasSubstr;

PageMessage text(std::string bytes, std::uint8_t lane = PageMessage::kNoLane) {
  return {std::make_shared<const std::string>(std::move(bytes)), false, lane};
}

// Greets pages, and takes "ok" from them and nothing else.
class Greeter final : public PageHandler {
 public:
  explicit Greeter(WebServer& server) : server_(server) {}
  void opened(PageId page) override {
    ++opened_;
    server_.send(page, text("hello"));
  }
  Expected<void> said(PageId /*page*/, std::string_view what) override {
    if (what != "ok") return fail("not ok");
    return {};
  }
  [[nodiscard]] int opened() const { return opened_; }

 private:
  WebServer& server_;
  std::atomic<int> opened_{0};
};

// A server that runs while it lives.
struct Running {
  explicit Running(WebServer served, std::uint16_t served_port)
      : server(std::move(served)), port(served_port), greeter(server), stop(eventfd(0, 0)), thread([this] {
          EXPECT_TRUE(server.run(greeter, stop));
        }) {}
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() { end(); }
  void end() {
    if (!thread.joinable()) return;
    const std::uint64_t one = 1;
    EXPECT_EQ(write(stop, &one, sizeof one), static_cast<ssize_t>(sizeof one));
    thread.join();
    close(stop);
  }
  // Pages that are open, once they are so many.
  bool has_pages(std::size_t count) {
    for (int i = 0; i < 1000 && server.pages() != count; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return server.pages() == count;
  }
  WebServer server;
  std::uint16_t port;
  Greeter greeter;
  int stop;
  std::thread thread;
};

std::unique_ptr<Running> run_server() {
  auto server = WebServer::listen({"127.0.0.1", 0}, view_page());
  EXPECT_TRUE(server) << server.error().message;
  const std::string url = server->url();
  EXPECT_THAT(url, testing::MatchesRegex("http://127.0.0.1:[0-9]+/"));
  const int port = std::stoi(url.substr(url.rfind(':') + 1));
  return std::make_unique<Running>(std::move(*server), static_cast<std::uint16_t>(port));
}

class Client {
 public:
  explicit Client(std::uint16_t port) : socket_(context_) {
    socket_.connect(tcp::endpoint(asio::ip::make_address("127.0.0.1"), port));
  }
  // All that comes back until the server closes.
  std::string exchange(const std::string& bytes) {
    asio::write(socket_, asio::buffer(bytes));
    std::string answer;
    beast::error_code ended;
    asio::read(socket_, asio::dynamic_buffer(answer), ended);
    return answer;
  }

 private:
  asio::io_context context_;
  tcp::socket socket_;
};

std::string get(const Running& running, const std::string& target, const std::string& fields = "",
                const std::string& method = "GET", const std::string& host = "127.0.0.1") {
  return Client(running.port)
      .exchange(method + " " + target + " HTTP/1.1\r\nHost: " + host + ":" + std::to_string(running.port) +
                "\r\nConnection: close\r\n" + fields + "\r\n");
}

constexpr const char* kTick = R"({"kind":"tick"})";

struct Page {
  explicit Page(std::uint16_t port, const std::string& origin = "") : stream(context) {
    const std::string host = "127.0.0.1:" + std::to_string(port);
    stream.next_layer().connect(tcp::endpoint(asio::ip::make_address("127.0.0.1"), port));
    stream.set_option(websocket::stream_base::decorator([origin](websocket::request_type& request) {
      if (!origin.empty()) request.set(beast::http::field::origin, origin);
    }));
    stream.handshake(host, "/live", error);
  }
  // The next message that is no sign of life; empty: it was closed.
  std::string read() {
    for (;;) {
      beast::flat_buffer buffer;
      stream.read(buffer, error);
      if (error) return "";
      const std::string message = beast::buffers_to_string(buffer.data());
      if (message != kTick) return message;
    }
  }
  asio::io_context context;
  websocket::stream<tcp::socket> stream;
  beast::error_code error;
};

TEST(WebServer, ServesThePageAndNothingElse) {
  const auto running = run_server();
  const std::string page = get(*running, "/");
  EXPECT_THAT(page, HasSubstr("HTTP/1.1 200 OK"));
  EXPECT_THAT(page, HasSubstr("Content-Security-Policy: default-src 'none'"));
  EXPECT_THAT(page, HasSubstr("<title>perimap</title>"));
  EXPECT_THAT(get(*running, "/main.mjs"), HasSubstr("Content-Type: text/javascript"));
  EXPECT_THAT(get(*running, "/", "", "HEAD"), testing::EndsWith("\r\n\r\n"));
  for (const char* target : {"/etc/passwd", "/../../etc/passwd", "/index.html", "/view.css/", "//"}) {
    EXPECT_THAT(get(*running, target), HasSubstr("HTTP/1.1 404")) << target;
  }
  EXPECT_THAT(get(*running, "/%2e%2e/etc/passwd"), HasSubstr("HTTP/1.1 400"));
  EXPECT_THAT(get(*running, "/" + std::string(1000, 'a')), HasSubstr("HTTP/1.1 414"));
  EXPECT_THAT(get(*running, "/", "", "DELETE"), HasSubstr("HTTP/1.1 405"));
  EXPECT_THAT(get(*running, "/live"), HasSubstr("HTTP/1.1 426"));
}

TEST(WebServer, RefusesWhatIsNoRequestAndGoesOn) {
  const auto running = run_server();
  EXPECT_THAT(Client(running->port).exchange("\x16\x03\x01 this is TLS\r\n\r\n"), HasSubstr("HTTP/1.1 400"));
  EXPECT_THAT(get(*running, "/", "A: " + std::string(20000, 'x') + "\r\n"), testing::Not(HasSubstr("200 OK")));
  EXPECT_THAT(get(*running, "/", "Host: elsewhere.example\r\n"), HasSubstr("HTTP/1.1 400"));
  EXPECT_THAT(get(*running, "/"), HasSubstr("HTTP/1.1 200"));
}

TEST(WebServer, APageOfElsewhereGetsNothing) {
  const auto running = run_server();
  EXPECT_THAT(get(*running, "/", "", "GET", "rebound.example"), HasSubstr("HTTP/1.1 403"));
  EXPECT_THAT(get(*running, "/", "Origin: http://elsewhere.example\r\n"), HasSubstr("HTTP/1.1 403"));
  const Page page(running->port, "http://elsewhere.example");
  EXPECT_TRUE(page.error);
  EXPECT_EQ(running->greeter.opened(), 0);
}

TEST(WebServer, APageIsGreetedAndHearsWhatIsSentToAll) {
  const auto running = run_server();
  Page page(running->port, "http://127.0.0.1:" + std::to_string(running->port));
  ASSERT_FALSE(page.error) << page.error.message();
  EXPECT_EQ(page.read(), "hello");
  running->server.post([&] { running->server.send_to_all(text("news")); });
  EXPECT_EQ(page.read(), "news");
}

TEST(WebServer, GivesSignsOfLife) {
  const auto running = run_server();
  Page page(running->port);
  EXPECT_EQ(page.read(), "hello");
  for (int i = 0; i < 2; ++i) {
    beast::flat_buffer buffer;
    page.stream.read(buffer, page.error);
    EXPECT_EQ(beast::buffers_to_string(buffer.data()), kTick);
  }
}

TEST(WebServer, MoreThanSixteenPagesAreTurnedAwayWithAReason) {
  const auto running = run_server();
  std::vector<std::unique_ptr<Page>> pages;
  for (std::size_t i = 0; i < WebServer::kMostPages; ++i) {
    pages.push_back(std::make_unique<Page>(running->port));
    EXPECT_EQ(pages.back()->read(), "hello");
  }
  Page late(running->port);
  EXPECT_EQ(late.read(), "");
  EXPECT_EQ(late.stream.reason().code, websocket::close_code::try_again_later);
  EXPECT_THAT(std::string(late.stream.reason().reason.c_str()), HasSubstr("16 pages are open already"));
  running->server.post([&] { running->server.send_to_all(text("news")); });
  for (const auto& page : pages) EXPECT_EQ(page->read(), "news");
  pages.pop_back();
  ASSERT_TRUE(running->has_pages(WebServer::kMostPages - 1));
  EXPECT_EQ(Page(running->port).read(), "hello");
}

TEST(WebServer, ABrokenFrameOrMessageDropsThatPageAlone) {
  const auto running = run_server();
  Page well(running->port);
  EXPECT_EQ(well.read(), "hello");
  // An operation that RFC 6455 does not have; a frame without its mask; a message that is too long; one that is wrong.
  const std::vector<std::string> broken = {std::string("\x83\x80xxxx", 6), std::string("\x81\x02ok", 4),
                                           std::string("\x81\xFE\x7F\xFFxxxx", 8) + std::string(0x7FFF, 'x')};
  for (const std::string& bytes : broken) {
    Page page(running->port);
    EXPECT_EQ(page.read(), "hello");
    asio::write(page.stream.next_layer(), asio::buffer(bytes), page.error);
    EXPECT_EQ(page.read(), "");
    ASSERT_TRUE(running->has_pages(1));
  }
  Page wrong(running->port);
  EXPECT_EQ(wrong.read(), "hello");
  wrong.stream.write(asio::buffer(std::string("ok")));
  wrong.stream.write(asio::buffer(std::string("do this")));
  EXPECT_EQ(wrong.read(), "");
  EXPECT_EQ(wrong.stream.reason().code, websocket::close_code::policy_error);
  running->server.post([&] { running->server.send_to_all(text("news")); });
  EXPECT_EQ(well.read(), "news");
}

TEST(WebServer, APageThatDoesNotReadGetsWhatIsNewOrIsDropped) {
  const auto running = run_server();
  Page well(running->port);
  Page slow(running->port);
  EXPECT_EQ(well.read(), "hello");
  EXPECT_EQ(slow.read(), "hello");
  // More than all buffers on the way hold: what is replaceable waits as one message, so that nobody is dropped.
  const std::string large(1 << 20, 'x');
  for (int i = 0; i < 40; ++i) {
    running->server.post([&, i] { running->server.send_to_all(text(std::to_string(i) + large, 1)); });
    EXPECT_FALSE(well.read().empty());
  }
  EXPECT_EQ(running->server.pages(), 2U);
  std::string last;
  for (int i = 0; i < 40 && last.substr(0, 2) != "39"; ++i) last = slow.read();
  EXPECT_EQ(last.substr(0, 2), "39");
  // What is not, is too much at last.
  for (int i = 0; i < 120; ++i) {
    running->server.post([&] { running->server.send_to_all(text(large)); });
    EXPECT_FALSE(well.read().empty());
  }
  EXPECT_TRUE(running->has_pages(1));
}

TEST(WebServer, PagesAreToldThatItGoes) {
  const auto running = run_server();
  Page page(running->port);
  EXPECT_EQ(page.read(), "hello");
  std::thread reader([&page] { EXPECT_EQ(page.read(), ""); });
  running->end();
  reader.join();
  EXPECT_EQ(page.stream.reason().code, websocket::close_code::going_away);
}

TEST(WebServer, ADeadPageDoesNotKeepItFromEnding) {
  const auto running = run_server();
  Page page(running->port);
  EXPECT_EQ(page.read(), "hello");
  running->end();
}

TEST(WebServer, SaysWhyItCannotListen) {
  const auto first = WebServer::listen({"127.0.0.1", 0}, view_page());
  ASSERT_TRUE(first);
  const std::string url = first->url();
  const auto port = static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
  const auto second = WebServer::listen({"127.0.0.1", port}, view_page());
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("another perimap view"));
  EXPECT_THAT(second.error().message, HasSubstr("--port"));
  const auto elsewhere = WebServer::listen({"192.0.2.1", 0}, view_page());
  ASSERT_FALSE(elsewhere);
  EXPECT_THAT(elsewhere.error().message, HasSubstr("192.0.2.1"));
  EXPECT_FALSE(WebServer::listen({"localhost", 0}, view_page()));
}

TEST(WebServer, ElsewhereTheAddressHasAToken) {
  const auto server = WebServer::listen({"0.0.0.0", 0}, view_page());
  ASSERT_TRUE(server);
  EXPECT_THAT(server->url(), testing::MatchesRegex("http://0.0.0.0:[0-9]+/\\?token=[0-9a-f]+"));
}

}  // namespace
}  // namespace perimap
