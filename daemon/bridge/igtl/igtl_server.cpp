#include "daemon/bridge/igtl/igtl_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <utility>
#include <vector>

#include "daemon/bridge/igtl/igtl_client.hpp"
#include "daemon/web/listen.hpp"

namespace perimap {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr auto kTick = std::chrono::milliseconds(100);
// Clients are told that the server goes; one that does not read is not waited for.
constexpr auto kGoodbye = std::chrono::milliseconds(500);
constexpr Duration kLine = std::chrono::seconds(1);
constexpr auto kGoodbyeLook = std::chrono::milliseconds(5);

}  // namespace

class IgtlServer::Impl {
 public:
  explicit Impl(Say say) : say_(std::move(say)) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    // The descriptor is its owner's.
    if (stop_.is_open()) (void)stop_.release();
  }

  Expected<void> listen(const Settings& settings) {
    error_code error;
    const auto address = asio::ip::make_address(settings.address, error);
    if (error) return fail(fmt::format("--bind: expected an address in numbers, got {:?}", settings.address));
    if (auto listening = listen_on(acceptor_, settings.address, settings.port, "perimap bridge igtl"); !listening) {
      return listening;
    }
    if (!address.is_loopback()) {
      say_(fmt::format("whoever reaches {} gets the surface: OpenIGTLink knows no keys", settings.address));
    }
    return {};
  }

  std::string endpoint() const {
    error_code error;
    const auto local = acceptor_.local_endpoint(error);
    const std::string address = local.address().to_string();
    return fmt::format("{}:{}", local.address().is_v6() ? "[" + address + "]" : address, local.port());
  }

  Expected<void> run(int stop_descriptor, std::function<void()> ending) {
    ending_call_ = std::move(ending);
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

  void send(const IgtlOutgoing& message) {
    if (closed_) return;
    newest_[static_cast<std::size_t>(message.subject)] = message;
    for (const auto& client : all()) client->send(message);
  }

  void forget(IgtlOutgoing::Subject subject) {
    if (closed_) return;
    newest_[static_cast<std::size_t>(subject)] = {};
    for (const auto& client : all()) client->forget(subject);
  }

  void at(Instant instant, std::function<void()> work) {
    if (closed_) return;
    // Both clocks are CLOCK_MONOTONIC.
    alarm_.expires_at(std::chrono::steady_clock::time_point(instant.time_since_epoch()));
    // One that was due already may be called although another was set.
    alarm_.async_wait([this, number = ++alarms_, work = std::move(work)](error_code error) {
      if (!error && number == alarms_ && !closed_) work();
    });
  }

  void end() {
    if (std::exchange(ending_, true)) return;
    error_code ignored;
    acceptor_.close(ignored);
    alarm_.cancel();
    if (ending_call_) ending_call_();
    closed_ = true;  // that was the last word
    goodbye_until_ = MonotonicClock::now() + kGoodbye;
    say_goodbye();
  }

 private:
  using Clients = std::map<std::uint64_t, std::shared_ptr<IgtlClient>>;

  // A copy, since one that is dropped leaves clients_ at once.
  std::vector<std::shared_ptr<IgtlClient>> all() const {
    std::vector<std::shared_ptr<IgtlClient>> all;
    for (const auto& [id, client] : clients_) all.push_back(client);
    return all;
  }

  void accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (ending_ || error == asio::error::operation_aborted) return;
      if (error) {
        // Descriptors have run out: clients that are there go on, and the next tick tries again.
        accept_again_ = true;
        return;
      }
      take(std::move(socket));
      accept();
    });
  }

  void take(tcp::socket socket) {
    if (clients_.size() >= kMostClients) {
      ++turned_away_;
      return;
    }
    const std::uint64_t id = ++last_id_;
    auto client = std::make_shared<IgtlClient>(std::move(socket), [this, id] { clients_.erase(id); });
    clients_.emplace(id, client);
    client->begin();
    for (const IgtlOutgoing& message : newest_) {
      if (message.bytes) client->send(message);
    }
  }

  void tick() {
    timer_.expires_after(kTick);
    timer_.async_wait([this](error_code error) {
      if (error || ending_) return;
      const Instant now = MonotonicClock::now();
      for (const auto& client : all()) {
        if (!client->stuck(now, kLongestWrite)) continue;
        ++dropped_;
        last_dropped_ = client->name();
        client->drop();
      }
      tell_of_clients(now);
      if (std::exchange(accept_again_, false)) accept();
      tick();
    });
  }

  // Whatever clients do, a line of each kind a second at most.
  void tell_of_clients(Instant now) {
    if (now - told_of_clients_ < kLine) return;
    if (dropped_ > 0) {
      say_(fmt::format("{} does not read what it is sent, and was dropped{}", last_dropped_,
                       dropped_ > 1 ? fmt::format(", as were {} others", dropped_ - 1) : ""));
    }
    if (turned_away_ > 0) {
      say_(fmt::format("{} clients are connected already: {} more turned away", kMostClients, turned_away_));
    }
    if (dropped_ + turned_away_ > 0) told_of_clients_ = now;
    dropped_ = turned_away_ = 0;
  }

  void say_goodbye() {
    const auto clients = all();
    const bool done = std::all_of(clients.begin(), clients.end(), [](const auto& client) { return client->idle(); });
    if (done || MonotonicClock::now() > goodbye_until_) return context_.stop();
    timer_.expires_after(kGoodbyeLook);
    timer_.async_wait([this](error_code) { say_goodbye(); });
  }

  asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  asio::steady_timer timer_{context_};
  asio::steady_timer alarm_{context_};
  asio::posix::stream_descriptor stop_{context_};
  const Say say_;
  std::function<void()> ending_call_;
  Clients clients_;
  std::array<IgtlOutgoing, IgtlOutgoing::kSubjects> newest_;
  std::uint64_t last_id_ = 0;
  Instant goodbye_until_;
  Instant told_of_clients_;
  std::size_t dropped_ = 0;
  std::size_t turned_away_ = 0;
  std::string last_dropped_;
  std::uint64_t alarms_ = 0;  // that were set
  bool closed_ = false;
  bool ending_ = false;
  bool accept_again_ = false;
};

IgtlServer::IgtlServer(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
IgtlServer::IgtlServer(IgtlServer&&) noexcept = default;
IgtlServer::~IgtlServer() = default;

Expected<IgtlServer> IgtlServer::listen(const Settings& settings, Say say) {
  auto impl = std::make_unique<Impl>(std::move(say));
  if (auto listening = impl->listen(settings); !listening) return tl::unexpected(listening.error());
  return IgtlServer(std::move(impl));
}

std::string IgtlServer::endpoint() const { return impl_->endpoint(); }
Expected<void> IgtlServer::run(int stop_descriptor, std::function<void()> ending) {
  return impl_->run(stop_descriptor, std::move(ending));
}
void IgtlServer::post(std::function<void()> work) { impl_->post(std::move(work)); }
void IgtlServer::send(const IgtlOutgoing& message) { impl_->send(message); }
void IgtlServer::forget(IgtlOutgoing::Subject subject) { impl_->forget(subject); }
void IgtlServer::at(Instant instant, std::function<void()> work) { impl_->at(instant, std::move(work)); }
void IgtlServer::end() { impl_->end(); }

}  // namespace perimap
