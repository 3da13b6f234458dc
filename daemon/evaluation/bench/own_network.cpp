#include "daemon/evaluation/bench/own_network.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace perimap::bench {
namespace {

// Where the environment has no settings of Cyclone DDS: on this host alone.
constexpr const char* kThisHost =
    "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast><MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize>"
    "</General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>40</MaxAutoParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>"
    "<Internal><SocketReceiveBufferSize max=\"8MB\"/></Internal></Domain></CycloneDDS>";

}  // namespace

void keep_to_ourselves() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): before the other threads begin
  const char* given = std::getenv("CYCLONEDDS_URI");
  const std::string settings = fmt::format(
      "{},<CycloneDDS><Domain Id=\"any\"><Discovery><Tag>perimap-bench-{}</Tag></Discovery></Domain></CycloneDDS>",
      given == nullptr || *given == '\0' ? kThisHost : given, getpid());
  // NOLINTNEXTLINE(concurrency-mt-unsafe): likewise
  setenv("CYCLONEDDS_URI", settings.c_str(), 1);
}

}  // namespace perimap::bench
