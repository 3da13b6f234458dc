#include "daemon/web/http_connection.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <string_view>
#include <utility>

namespace perimap {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;

constexpr std::uint32_t kMostHeadBytes = 8192;
constexpr auto kLongestExchange = std::chrono::seconds(10);

// The page loads nothing from elsewhere, and no other page may hold it in a frame.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view(boost::beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

HttpConnection::HttpConnection(boost::asio::ip::tcp::socket socket, const Access& access, const WebService& service,
                               Upgrade upgrade, std::shared_ptr<std::size_t> open)
    : stream_(std::move(socket)),
      access_(access),
      service_(service),
      upgrade_(std::move(upgrade)),
      open_(std::move(open)) {
  ++*open_;
}

HttpConnection::~HttpConnection() { --*open_; }

void HttpConnection::read() {
  parser_.emplace();
  parser_->header_limit(kMostHeadBytes);
  stream_.expires_after(kLongestExchange);
  http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
    if (!error) return self->answer();
    // What is no request is told so; a connection that ended, or said nothing, just goes.
    if (error.category() == make_error_code(http::error::bad_method).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message) {
      self->refuse(400, "this is no request that a page makes");
    }
  });
}

void HttpConnection::answer() {
  const Request& request = parser_->get();
  const auto field = [&request](http::field name) { return view(request[name]); };
  // Several fields of one name are no browser's.
  if (request.count(http::field::host) != 1 || request.count(http::field::origin) > 1) {
    return refuse(400, "a request has one host");
  }
  const auto target = admit(access_, {view(request.target()), field(http::field::host), field(http::field::origin),
                                      field(http::field::cookie)});
  if (!target) {
    const std::string_view origin = field(http::field::origin);
    if (!origin.empty() && service_.origin_refused) service_.origin_refused(origin);
    return refuse(target.error().status, target.error().message);
  }
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    return refuse(405, "nothing can be changed here");
  }
  if (target->path == service_.socket_path) return upgrade();
  const auto file = std::find_if(service_.files.begin(), service_.files.end(),
                                 [&target](const PageFile& served) { return served.path == target->path; });
  if (file == service_.files.end()) return refuse(404, "there is no such file");
  answer_with(*file);
}

void HttpConnection::upgrade() {
  const Request& request = parser_->get();
  if (!beast::websocket::is_upgrade(request)) return refuse(426, "this is for a WebSocket");
  std::string chosen;
  if (!service_.subprotocols.empty()) {
    for (const auto& wanted : http::token_list(request[http::field::sec_websocket_protocol])) {
      if (!chosen.empty()) break;
      const auto known = std::find(service_.subprotocols.begin(), service_.subprotocols.end(), view(wanted));
      if (known != service_.subprotocols.end()) chosen = *known;
    }
    if (chosen.empty()) {
      return refuse(400, fmt::format("here a client speaks {}", fmt::join(service_.subprotocols, " or ")));
    }
  }
  stream_.expires_never();
  upgrade_(std::move(stream_), request, chosen);
}

void HttpConnection::answer_with(const PageFile& file) {
  Text response(http::status::ok, parser_->get().version());
  response.set(http::field::content_type, boost::beast::string_view(file.type.data(), file.type.size()));
  if (!access_.token.empty()) {
    response.set(http::field::set_cookie, token_cookie(access_) + "; Path=/; HttpOnly; SameSite=Strict");
  }
  response.body().assign(file.content.data(), file.content.size());
  send(std::move(response));
}

void HttpConnection::refuse(unsigned status, std::string_view why) {
  Text response(static_cast<http::status>(status), 11);
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  if (status == 405) response.set(http::field::allow, "GET, HEAD");
  response.body().assign(why.data(), why.size());
  response.body() += "\n";
  response.keep_alive(false);
  send(std::move(response));
}

void HttpConnection::send(Text response) {
  response.set(http::field::cache_control, "no-store");
  response.set("Content-Security-Policy", kPolicy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Referrer-Policy", "no-referrer");
  const bool keep = response.result() == http::status::ok && parser_->get().keep_alive();
  response.keep_alive(keep);
  response.prepare_payload();
  if (parser_->get().method() == http::verb::head) response.body().clear();
  response_ = std::make_shared<Text>(std::move(response));
  http::async_write(stream_, *response_, [self = shared_from_this(), keep](error_code error, std::size_t) {
    if (error) return;
    if (keep) return self->read();
    error_code ignored;
    self->stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
  });
}

}  // namespace perimap
