// `perimap bridge`: what is published, to programs that do not speak DDS.
#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/bridge/foxglove/foxglove_bridge.hpp"
#include "daemon/bridge/igtl/igtl_bridge.hpp"
#include "daemon/bridge/igtl/igtl_server.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/keys/key_folder.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/web/web_server.hpp"

namespace perimap {
namespace {

struct BridgeOptions {
  int domain = 0;
  std::string address = "127.0.0.1";
  int port = 0;
  std::optional<std::string> security;
  std::vector<std::string> origins;  // of foxglove
};

// What all bridges ask before they serve.
Expected<StopSignal> begin(const BridgeOptions& options, const Console& console) {
  if (options.security) {
    const auto keys = check_keys(*options.security, seconds_now());
    if (!keys) return fail("--security: " + keys.error().message);
    if (const auto warning = expiry_warning(*keys, seconds_now())) console.complain("warning: " + *warning);
  }
  Expected<StopSignal> stop = StopSignal::install();
  // What predicts comes before what shows.
  (void)setpriority(PRIO_PROCESS, 0, 2);
  return stop;
}

// None: it can be listened on.
std::optional<std::string> wrong_address(const std::string& address) {
  if (address != "0.0.0.0" && address != "::") return std::nullopt;
  return "--bind: expected one address of this host, which others can reach, got " + address;
}

void print_endpoint(const std::string& endpoint) {
  fmt::print("{}\n", endpoint);
  (void)std::fflush(stdout);
}

Outcome bridge_igtl(const BridgeOptions& options, const Console& console) {
  if (const auto wrong = wrong_address(options.address)) return refuse(*wrong, ExitCode::kWrongUsage);
  Expected<StopSignal> stop = begin(options, console);
  if (!stop) return refuse(stop.error());
  const auto say = [&console](const std::string& what) { console.complain(what); };
  Expected<IgtlServer> server = IgtlServer::listen({options.address, static_cast<std::uint16_t>(options.port)}, say);
  if (!server) return refuse(server.error());
  auto bridge = IgtlBridge::create({options.domain, options.security}, *server, say);
  if (!bridge) return refuse(bridge.error());
  print_endpoint(server->endpoint());
  if (const auto ran = (*bridge)->run(stop->descriptor()); !ran) return refuse(ran.error());
  return {};
}

Outcome bridge_foxglove(const BridgeOptions& options, const Console& console) {
  if (const auto wrong = wrong_address(options.address)) return refuse(*wrong, ExitCode::kWrongUsage);
  Expected<StopSignal> stop = begin(options, console);
  if (!stop) return refuse(stop.error());
  Expected<WebServer> server = WebServer::listen({options.address, static_cast<std::uint16_t>(options.port)},
                                                 FoxgloveBridge::service(options.origins));
  if (!server) return refuse(server.error());
  const auto bridge =
      FoxgloveBridge::create({options.domain, options.security}, *server, fmt::format("perimap {}", PERIMAP_VERSION),
                             [&console](const std::string& what) { console.complain(what); });
  if (!bridge) return refuse(bridge.error());
  print_endpoint(server->url());
  if (const auto ran = server->run(**bridge, stop->descriptor()); !ran) return refuse(ran.error());
  if (const auto result = (*bridge)->result(); !result) return refuse(result.error());
  return {};
}

void add_options(Command& command, BridgeOptions& options, const char* bind_help) {
  command.add_option("--domain", options.domain, "DDS domain")->check(Range(0, 230))->capture_default_str();
  command.add_option("--security", options.security,
                     "Keys for DDS Security, as perimap keys issue makes them (a folder), where the domain is secured");
  command.add_option("--port", options.port, "TCP port that clients connect to; 0: any that is free")
      ->check(Range(0, 65535))
      ->capture_default_str();
  command.add_option("--bind", options.address, bind_help)->capture_default_str();
}

}  // namespace

void add_bridge_command(Commands& commands) {
  Command& group = commands.add_group(
      "bridge",
      "Hands what a running perimapd publishes on to programs that do not speak DDS; nothing of an invalid surface");
  const auto for_igtl = std::make_shared<BridgeOptions>();
  for_igtl->port = 18944;
  Command& igtl = commands.add(
      group, "igtl",
      "Serves OpenIGTLink, as for 3D Slicer: POLYDATA of the surface, TRANSFORM of the camera, STATUS with what may be "
      "trusted and why not. Prints the address that clients connect to",
      [for_igtl](const Console& console) { return bridge_igtl(*for_igtl, console); });
  add_options(
      igtl, *for_igtl,
      "An address of this host, in numbers, under which clients elsewhere may connect too; OpenIGTLink knows no "
      "keys, so that whoever reaches it gets the surface");
  const auto for_foxglove = std::make_shared<BridgeOptions>();
  for_foxglove->port = 8765;
  Command& foxglove = commands.add(
      group, "foxglove",
      "Serves the viewers Foxglove and Lichtblick: the surface as a scene, the camera's pose, what may be trusted and "
      "why not. Prints the address that they connect to",
      [for_foxglove](const Console& console) { return bridge_foxglove(*for_foxglove, console); });
  add_options(foxglove, *for_foxglove,
              "An address of this host, in numbers, under which viewers elsewhere may connect too; the address that is "
              "printed then has a token");
  foxglove.add_option("--allow-origin", for_foxglove->origins,
                      "A viewer that runs in a browser may connect when its page came from here, as "
                      "https://app.foxglove.dev; may be given several times");
}

}  // namespace perimap
