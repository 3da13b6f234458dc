// HTTP and WebSocket: by Boost.Beast (docs/decisions/0089), on one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/web/page_message.hpp"
#include "daemon/web/web_service.hpp"

namespace perimap {

// What the pages show, and what they ask. All calls come from the server's thread.
class PageHandler {
 public:
  PageHandler() = default;
  PageHandler(const PageHandler&) = delete;
  PageHandler& operator=(const PageHandler&) = delete;
  virtual ~PageHandler() = default;

  virtual void opened(PageId page) = 0;
  virtual void closed(PageId /*page*/) {}
  // The server goes: what is sent now is the last that pages get.
  virtual void ending() {}
  // An error drops that page.
  [[nodiscard]] virtual Expected<void> said(PageId page, std::string_view text) = 0;
  // Ten times a second.
  virtual void tick() {}
  // After the server has run: why it ended by itself, if it did.
  [[nodiscard]] virtual Expected<void> result() const { return {}; }
};

class WebServer {
 public:
  static constexpr std::size_t kMostPages = 16;

  struct Settings {
    std::string address = "127.0.0.1";  // in numbers
    std::uint16_t port = 0;             // 0: any that is free
  };

  // Elsewhere than on loopback a token is drawn. An error says which address it is, and what to do.
  [[nodiscard]] static Expected<WebServer> listen(const Settings& settings, WebService service);
  WebServer(WebServer&&) noexcept;
  WebServer& operator=(WebServer&&) noexcept;
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer();

  // What clients open, the token included.
  [[nodiscard]] std::string url() const;

  // Until the descriptor becomes readable (a StopSignal's). Pages are then told that the server goes.
  [[nodiscard]] Expected<void> run(PageHandler& handler, int stop_descriptor);

  // From any thread: `work` is done on the server's, while it runs.
  void post(std::function<void()> work);
  // From any thread.
  [[nodiscard]] std::size_t pages() const noexcept;

  // On the server's thread.
  void end();
  void send(PageId page, const PageMessage& message);
  void send_to_all(const PageMessage& message);

 private:
  class Impl;
  explicit WebServer(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace perimap
