// `perimap bridge`: what is published, to programs that do not speak DDS.
#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "daemon/bridge/igtl/igtl_bridge.hpp"
#include "daemon/bridge/igtl/igtl_server.hpp"
#include "daemon/command_line/commands.hpp"
#include "daemon/keys/key_folder.hpp"
#include "daemon/process/stop_signal.hpp"

namespace perimap {
namespace {

struct BridgeOptions {
  int domain = 0;
  std::string address = "127.0.0.1";
  int port = 18944;
  std::optional<std::string> security;
};

Outcome bridge_igtl(const BridgeOptions& options, const Console& console) {
  if (options.security) {
    const auto keys = check_keys(*options.security, seconds_now());
    if (!keys) return refuse(Error{"--security: " + keys.error().message}, ExitCode::kWrongUsage);
    if (const auto warning = expiry_warning(*keys, seconds_now())) console.complain("warning: " + *warning);
  }
  if (options.address == "0.0.0.0" || options.address == "::") {
    return refuse("--bind: expected one address of this host, which others can reach, got " + options.address,
                  ExitCode::kWrongUsage);
  }
  Expected<StopSignal> stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  // What predicts comes before what shows.
  (void)setpriority(PRIO_PROCESS, 0, 2);
  const auto say = [&console](const std::string& what) { console.complain(what); };
  Expected<IgtlServer> server = IgtlServer::listen({options.address, static_cast<std::uint16_t>(options.port)}, say);
  if (!server) return refuse(server.error());
  auto bridge = IgtlBridge::create({options.domain, options.security}, *server, say);
  if (!bridge) return refuse(bridge.error());
  fmt::print("{}\n", server->endpoint());
  (void)std::fflush(stdout);
  if (const auto ran = (*bridge)->run(stop->descriptor()); !ran) return refuse(ran.error());
  return {};
}

}  // namespace

void add_bridge_command(Commands& commands) {
  Command& group = commands.add_group(
      "bridge",
      "Hands what a running perimapd publishes on to programs that do not speak DDS; nothing of an invalid surface");
  const auto options = std::make_shared<BridgeOptions>();
  Command& igtl = commands.add(
      group, "igtl",
      "Serves OpenIGTLink, as for 3D Slicer: POLYDATA of the surface, TRANSFORM of the camera, STATUS with what may be "
      "trusted and why not. Prints the address that clients connect to",
      [options](const Console& console) { return bridge_igtl(*options, console); });
  igtl.add_option("--domain", options->domain, "DDS domain")->check(Range(0, 230))->capture_default_str();
  igtl.add_option("--security", options->security,
                  "Keys for DDS Security, as perimap keys issue makes them (a folder), where the domain is secured");
  igtl.add_option("--port", options->port, "TCP port that clients connect to; 0: any that is free")
      ->check(Range(0, 65535))
      ->capture_default_str();
  igtl.add_option("--bind", options->address,
                  "An address of this host, in numbers, under which clients elsewhere may connect too; OpenIGTLink "
                  "knows no keys, so that whoever reaches it gets the surface")
      ->capture_default_str();
}

}  // namespace perimap
