// `perimap bridge`: what is published, to programs that do not speak DDS.
#include <fmt/format.h>
#include <sys/resource.h>

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/bridge/foxglove/foxglove_bridge.hpp"
#include "daemon/bridge/igtl/igtl_bridge.hpp"
#include "daemon/bridge/igtl/igtl_server.hpp"
#include "daemon/bridge/ros2/ros2_bridge.hpp"
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
  std::optional<int> ros_domain;     // of ros2
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
  const auto say = [&console](const std::string& what) { console.complain(what); };
  auto service = FoxgloveBridge::service(options.origins, say);
  if (!service) return refuse(Error{"--allow-origin: " + service.error().message}, ExitCode::kWrongUsage);
  Expected<WebServer> server =
      WebServer::listen({options.address, static_cast<std::uint16_t>(options.port)}, std::move(*service));
  if (!server) return refuse(server.error());
  const auto bridge = FoxgloveBridge::create({options.domain, options.security}, *server,
                                             fmt::format("perimap {}", PERIMAP_VERSION), say);
  if (!bridge) return refuse(bridge.error());
  print_endpoint(server->url());
  if (const auto ran = server->run(**bridge, stop->descriptor()); !ran) return refuse(ran.error());
  if (const auto result = (*bridge)->result(); !result) return refuse(result.error());
  return {};
}

// By --ros-domain, or by the environment, as ROS 2 itself goes by it; 0 where neither tells one.
Expected<int> ros_domain(const BridgeOptions& options) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here writes the environment
  const char* const text = std::getenv("ROS_DOMAIN_ID");
  if (options.ros_domain || text == nullptr || *text == '\0') return options.ros_domain.value_or(0);
  int domain = -1;
  const char* const end = text + std::strlen(text);
  const auto [read, error] = std::from_chars(text, end, domain);
  if (error != std::errc() || read != end || domain < 0 || domain > 230) {
    return fail(fmt::format("ROS_DOMAIN_ID: expected a number from 0 to 230, got {:?}", std::string_view(text)));
  }
  return domain;
}

Outcome bridge_ros2(const BridgeOptions& options, const Console& console) {
  Expected<StopSignal> stop = begin(options, console);
  if (!stop) return refuse(stop.error());
  const auto domain = ros_domain(options);
  if (!domain) return refuse(domain.error(), ExitCode::kWrongUsage);
  const auto bridge = Ros2Bridge::create({options.domain, options.security}, *domain,
                                         [&console](const std::string& what) { console.complain(what); });
  if (!bridge) return refuse(bridge.error());
  print_endpoint(
      fmt::format("ROS 2 domain {}: /perimap/points, /perimap/mesh, /perimap/tools, /tf, /diagnostics", *domain));
  if (const auto ran = (*bridge)->run(stop->descriptor()); !ran) return refuse(ran.error());
  return {};
}

void add_domain_options(Command& command, BridgeOptions& options) {
  command.add_option("--domain", options.domain, "DDS domain")->check(Range(0, 230))->capture_default_str();
  command.add_option("--security", options.security,
                     "Keys for DDS Security, as perimap keys issue makes them (a folder), where the domain is secured");
}

void add_options(Command& command, BridgeOptions& options, const char* bind_help) {
  add_domain_options(command, options);
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
                      "A viewer may connect when its page came from here: https://app.foxglove.dev, or file:// for the "
                      "viewers' desktop programs; what is refused is told. May be given several times");
  const auto for_ros2 = std::make_shared<BridgeOptions>();
  Command& ros2 = commands.add(
      group, "ros2",
      "Publishes standard messages of ROS 2 (Humble and later) in its DDS domain, without ROS: points and mesh of the "
      "surface, the camera's pose, diagnostics with what may be trusted and why not. Prints the topics",
      [for_ros2](const Console& console) { return bridge_ros2(*for_ros2, console); });
  add_domain_options(ros2, *for_ros2);
  ros2.add_option("--ros-domain", for_ros2->ros_domain, "DDS domain of ROS 2; by default ROS_DOMAIN_ID, else 0")
      ->check(Range(0, 230));
}

}  // namespace perimap
