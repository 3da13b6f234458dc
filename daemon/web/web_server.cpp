#include "daemon/web/web_server.hpp"

#include <fmt/format.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <utility>
#include <vector>

#include "daemon/web/access.hpp"
#include "daemon/web/http_connection.hpp"
#include "daemon/web/listen.hpp"
#include "daemon/web/page_socket.hpp"

namespace perimap {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

// Connections that are no page (yet): a browser opens six at once.
constexpr std::size_t kMostConnections = 64;
constexpr auto kTick = std::chrono::milliseconds(100);
// Every so manieth tick pages get a sign of life, so that silence is known from a server that has gone.
constexpr int kTicksToSign = 2;
// Pages are told that the server goes; one that does not answer is not waited for.
constexpr auto kGoodbye = std::chrono::milliseconds(500);

}  // namespace

class WebServer::Impl {
 public:
  explicit Impl(WebService service)
      : service_(std::move(service)), acceptor_(context_), timer_(context_), stop_(context_) {
    access_.origins = service_.origins;
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    // The descriptor is its owner's.
    if (stop_.is_open()) (void)stop_.release();
  }

  Expected<void> listen(const Settings& settings) {
    const auto loopback = is_loopback(settings.address);
    if (!loopback) return tl::unexpected(loopback.error());
    access_.loopback = *loopback;
    if (!*loopback) {
      auto token = make_token();
      if (!token) return tl::unexpected(token.error());
      access_.token = std::move(*token);
    }
    if (auto listening = listen_on(acceptor_, settings.address, settings.port, service_.command); !listening) {
      return listening;
    }
    error_code error;
    access_.port = acceptor_.local_endpoint(error).port();
    address_ = settings.address;
    return {};
  }

  std::string url() const {
    const bool v6 = address_.find(':') != std::string::npos;
    std::string url = fmt::format("{}://{}:{}{}", service_.scheme, v6 ? "[" + address_ + "]" : address_, access_.port,
                                  service_.files.empty() ? service_.socket_path : "/");
    if (!access_.token.empty()) url += "?token=" + access_.token;
    return url;
  }

  Expected<void> run(PageHandler& handler, int stop_descriptor) {
    handler_ = &handler;
    error_code error;
    stop_.assign(stop_descriptor, error);
    if (error) return fail(fmt::format("cannot wait for a signal to end: {}", error.message()));
    stop_.async_wait(asio::posix::descriptor_base::wait_read, [this](error_code failed) {
      if (!failed) end();
    });
    accept();
    tick();
    context_.run();
    return {};
  }

  void post(std::function<void()> work) { asio::post(context_, std::move(work)); }
  std::size_t pages() const noexcept { return count_.load(std::memory_order_relaxed); }

  void end() {
    if (!ending_) say_goodbye();
  }

  void send(PageId page, const PageMessage& message) {
    const auto found = pages_.find(page);
    if (found != pages_.end()) std::shared_ptr<PageSocket>(found->second)->send(message);
  }

  void send_to_all(const PageMessage& message) {
    for (const auto& page : all()) page->send(message);
  }

 private:
  using Pages = std::map<PageId, std::shared_ptr<PageSocket>>;

  // Since sending may drop a page.
  std::vector<std::shared_ptr<PageSocket>> all() const {
    std::vector<std::shared_ptr<PageSocket>> all;
    for (const auto& [id, page] : pages_) all.push_back(page);
    return all;
  }

  void accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (ending_ || error == asio::error::operation_aborted) return;
      if (error) {
        // Descriptors have run out: those that are open go on, and the next tick tries again.
        accept_again_ = true;
        return;
      }
      if (*connections_ < kMostConnections) {
        std::make_shared<HttpConnection>(
            std::move(socket), access_, service_,
            [this](boost::beast::tcp_stream stream, const HttpConnection::Request& request,
                   const std::string& subprotocol) { open_page(std::move(stream), request, subprotocol); },
            connections_)
            ->read();
      }
      accept();
    });
  }

  void open_page(boost::beast::tcp_stream stream, const HttpConnection::Request& request,
                 const std::string& subprotocol) {
    if (ending_) return;
    if (pages_.size() >= kMostPages) {
      return std::make_shared<PageSocket>(std::move(stream), service_.command, PageSocket::Events{})
          ->turn_away(request, subprotocol, fmt::format("{} pages are open already: close one of them", kMostPages));
    }
    const PageId id = ++last_id_;
    auto page = std::make_shared<PageSocket>(
        std::move(stream), service_.command,
        PageSocket::Events{[this, id] { handler_->opened(id); },
                           [this, id](std::string_view text) { return handler_->said(id, text); },
                           [this, id] { forget(id); }});
    pages_.emplace(id, page);
    count_.store(pages_.size(), std::memory_order_relaxed);
    page->accept(request, subprotocol);
  }

  void forget(PageId id) {
    pages_.erase(id);
    handler_->closed(id);
    // Relaxed: a hint of whether anything has to be made.
    count_.store(pages_.size(), std::memory_order_relaxed);
    if (ending_ && pages_.empty()) context_.stop();
  }

  void tick() {
    timer_.expires_after(kTick);
    timer_.async_wait([this](error_code error) {
      if (error || ending_) return;
      const Instant now = MonotonicClock::now();
      for (const auto& page : all()) {
        if (page->stuck(now)) page->drop();
      }
      if (std::exchange(accept_again_, false)) accept();
      if (!service_.sign_of_life.empty() && ++ticks_ % kTicksToSign == 0) {
        send_to_all({std::make_shared<const std::string>(service_.sign_of_life), false, PageMessage::kSignOfLife});
      }
      handler_->tick();
      tick();
    });
  }

  void say_goodbye() {
    ending_ = true;
    error_code ignored;
    acceptor_.close(ignored);
    handler_->ending();
    if (pages_.empty()) return context_.stop();
    for (const auto& page : all()) page->say_goodbye();
    timer_.expires_after(kGoodbye);
    timer_.async_wait([this](error_code) { context_.stop(); });
  }

  const WebService service_;
  asio::io_context context_{1};
  tcp::acceptor acceptor_;
  asio::steady_timer timer_;
  asio::posix::stream_descriptor stop_;
  Access access_;
  std::string address_;
  PageHandler* handler_ = nullptr;
  Pages pages_;
  PageId last_id_ = 0;
  std::atomic<std::size_t> count_{0};
  std::shared_ptr<std::size_t> connections_ = std::make_shared<std::size_t>(0);
  int ticks_ = 0;
  bool ending_ = false;
  bool accept_again_ = false;
};

WebServer::WebServer(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
WebServer::WebServer(WebServer&&) noexcept = default;
WebServer& WebServer::operator=(WebServer&&) noexcept = default;
WebServer::~WebServer() = default;

Expected<WebServer> WebServer::listen(const Settings& settings, WebService service) {
  auto impl = std::make_unique<Impl>(std::move(service));
  if (auto listening = impl->listen(settings); !listening) return tl::unexpected(listening.error());
  return WebServer(std::move(impl));
}

std::string WebServer::url() const { return impl_->url(); }
Expected<void> WebServer::run(PageHandler& handler, int stop_descriptor) {
  return impl_->run(handler, stop_descriptor);
}
void WebServer::end() { impl_->end(); }
void WebServer::post(std::function<void()> work) { impl_->post(std::move(work)); }
std::size_t WebServer::pages() const noexcept { return impl_->pages(); }
void WebServer::send(PageId page, const PageMessage& message) { impl_->send(page, message); }
void WebServer::send_to_all(const PageMessage& message) { impl_->send_to_all(message); }

}  // namespace perimap
