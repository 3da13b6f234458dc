// What a web server is there for.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/web/page_file.hpp"

namespace perimap {

// A page is whoever has opened the WebSocket: a page of ours in a browser, or a program of others.
struct WebService {
  std::string_view command;            // "perimap view", for whoever reads a message
  std::string_view scheme = "http";    // of the address that is printed
  std::string_view socket_path = "/";  // where the WebSocket is
  std::span<const PageFile> files;     // what else is served
  // A client speaks one of these (RFC 6455 section 1.9), the first of its own that is among them; empty: none is named.
  std::vector<std::string> subprotocols;
  // Of pages of elsewhere that may connect too, as browsers tell it: "https://app.example".
  std::vector<std::string> origins;
  // On the server's thread: a page of this origin was refused. Any bytes.
  std::function<void(std::string_view)> origin_refused;
  // Text that pages get five times a second, so that silence is known from a server that has gone; empty: they do not.
  std::string sign_of_life;
};

}  // namespace perimap
