#include "daemon/evaluation/bench/open_pages.hpp"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>

namespace perimap::bench {
namespace {

// "http://127.0.0.1:7374/": the port; nothing of another line.
std::optional<std::uint16_t> port_in(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (!address.starts_with("http://") || colon == std::string::npos) return std::nullopt;
  std::uint16_t port = 0;
  const auto read = std::from_chars(address.data() + colon + 1, address.data() + address.size(), port);
  return read.ec == std::errc() && port != 0 ? std::optional(port) : std::nullopt;
}

}  // namespace

Expected<OpenPages> OpenPages::open(int domain, int pages, const std::filesystem::path& scratch) {
  const auto browser = find_program("chromium");
  if (!browser) return fail("chromium is not installed");
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return fail("/proc/self/exe: " + error.message());
  auto view = ChildProcess::start(self.string(), {"view", "--domain", std::to_string(domain), "--port", "0"});
  if (!view) return tl::unexpected(view.error());
  const std::string address = view->read_line().value_or("");
  const auto port = port_in(address);
  if (!port) return fail("perimap view has no page");
  OpenPages open(std::move(*view), *port);
  for (int i = 0; i < pages; ++i) {
    const std::string profile = (scratch / fmt::format("page-{}", i)).string();
    // The debugging port keeps a headless browser where it is.
    auto page = ChildProcess::start(
        *browser, {"--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
                   "--mute-audio", "--disable-background-networking", "--disable-component-update", "--log-level=3",
                   "--remote-debugging-port=0", "--user-data-dir=" + profile, "--window-size=1280,720", address});
    if (!page) return tl::unexpected(page.error());
    open.browsers_.push_back(std::move(*page));
  }
  return open;
}

int OpenPages::connected() const { return established_at(port_); }

int established_at(std::uint16_t port, const std::filesystem::path& table) {
  constexpr std::string_view kEstablished = "01";
  const std::string at = fmt::format(":{:04X}", port);
  std::ifstream connections(table);
  int count = 0;
  for (std::string line; std::getline(connections, line);) {
    std::istringstream words(line);
    std::string number, local, remote, state;
    if (words >> number >> local >> remote >> state && state == kEstablished && local.ends_with(at)) ++count;
  }
  return count;
}

}  // namespace perimap::bench
