// `perimap view`: what is published, as a page in a browser.
#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "daemon/command_line/commands.hpp"
#include "daemon/keys/key_folder.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/view/live/live_view.hpp"
#include "daemon/view/page/view_page.hpp"
#include "daemon/view/recorded/recorded_view.hpp"
#include "daemon/web/web_server.hpp"

namespace perimap {
namespace {

struct ViewOptions {
  RecordedView::Files files;  // without a recording: live
  int domain = 0;
  std::string address = "127.0.0.1";
  int port = 7374;
  std::optional<std::string> security;
};

void print_address(const WebServer& server) {
  fmt::print("{}\n", server.url());
  (void)std::fflush(stdout);
}

Expected<std::unique_ptr<PageHandler>> open_view(const ViewOptions& options, WebServer& server,
                                                 const std::function<void(const std::string&)>& say) {
  const auto as_handler = [](auto view) { return std::unique_ptr<PageHandler>(std::move(view)); };
  if (!options.files.recording.empty()) return RecordedView::open(options.files, server, say).map(as_handler);
  return LiveView::create({options.domain, options.security}, server, say).map(as_handler);
}

Outcome view(const ViewOptions& options, const Console& console) {
  if (options.files.recording.empty() && !options.files.samples.empty()) {
    return refuse("--samples goes with a RECORDING of the devices; by itself it is the RECORDING",
                  ExitCode::kWrongUsage);
  }
  if (options.security) {
    const auto keys = check_keys(*options.security, seconds_now());
    if (!keys) return refuse(Error{"--security: " + keys.error().message}, ExitCode::kWrongUsage);
    if (const auto warning = expiry_warning(*keys, seconds_now())) console.complain("warning: " + *warning);
  }
  if (options.address == "0.0.0.0" || options.address == "::") {
    return refuse("--bind: expected one address of this host, which others can open, got " + options.address,
                  ExitCode::kWrongUsage);
  }
  Expected<StopSignal> stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  // What predicts comes before what shows.
  (void)setpriority(PRIO_PROCESS, 0, 2);
  Expected<WebServer> server =
      WebServer::listen({options.address, static_cast<std::uint16_t>(options.port)}, view_page());
  if (!server) return refuse(server.error());
  const auto say = [&console](const std::string& what) { console.complain(what); };
  const auto handler = open_view(options, *server, say);
  if (!handler) return refuse(handler.error());
  print_address(*server);
  if (const auto ran = server->run(**handler, stop->descriptor()); !ran) return refuse(ran.error());
  if (const auto result = (*handler)->result(); !result) return refuse(result.error());
  return {};
}

}  // namespace

void add_view_command(Commands& commands) {
  const auto options = std::make_shared<ViewOptions>();
  Command& command = commands.add(
      "view",
      "Serves a page that shows what a running perimapd publishes, or what a recording holds: what may be trusted and "
      "why not, the surface as it moves, the heart's phase, the sources and delays. Prints the address to open in a "
      "browser",
      [options](const Console& console) { return view(*options, console); });
  command.add_option("RECORDING", options->files.recording,
                     "Show this recording (MCAP), with a time line to drag; without one, what is published now");
  command.add_option("--samples", options->files.samples,
                     "What was published of it (perimap watch --record, perimap replay --samples)");
  command.add_option("--domain", options->domain, "DDS domain")->check(Range(0, 230))->capture_default_str();
  command.add_option("--security", options->security,
                     "Keys for DDS Security, as perimap keys issue makes them (a folder), where the domain is secured");
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
