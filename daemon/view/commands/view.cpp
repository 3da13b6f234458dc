// `perimap view`: what is published, as a page in a browser.
#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/view/live/live_view.hpp"
#include "daemon/view/web/web_server.hpp"

namespace perimap {
namespace {

struct ViewOptions {
  int domain = 0;
  std::string address = "127.0.0.1";
  int port = 7374;
};

void print_address(const WebServer& server) {
  fmt::print("{}\n", server.url());
  (void)std::fflush(stdout);
}

Outcome view(const ViewOptions& options, const Console& console) {
  Expected<StopSignal> stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  // What predicts comes before what shows.
  (void)setpriority(PRIO_PROCESS, 0, 5);
  Expected<WebServer> server = WebServer::listen({options.address, static_cast<std::uint16_t>(options.port)});
  if (!server) return refuse(server.error());
  const auto live =
      LiveView::create(options.domain, *server, [&console](const std::string& what) { console.complain(what); });
  if (!live) return refuse(live.error());
  print_address(*server);
  server->run(**live, stop->descriptor());
  return {};
}

}  // namespace

void add_view_command(Commands& commands) {
  const auto options = std::make_shared<ViewOptions>();
  Command& command = commands.add(
      "view",
      "Serves a page that shows what a running perimapd publishes: what may be trusted and why not, the surface as it "
      "moves, the heart's phase, the sources and delays. Prints the address to open in a browser",
      [options](const Console& console) { return view(*options, console); });
  command.add_option("--domain", options->domain, "DDS domain")->check(Range(0, 230))->capture_default_str();
  command.add_option("--port", options->port, "Where the page is served; 0: any port that is free")
      ->check(Range(0, 65535))
      ->capture_default_str();
  command
      .add_option("--bind", options->address,
                  "An address of this host, in numbers, under which others may open the page too; the address that "
                  "is printed then has a token")
      ->capture_default_str();
}

}  // namespace perimap
