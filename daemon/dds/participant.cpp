#include "daemon/dds/participant.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "daemon/dds/security.hpp"
#include "daemon/dds/topic.hpp"

namespace perimap::dds {
namespace {

constexpr const char* kWithoutIndex =
    "<CycloneDDS><Domain "
    "Id=\"any\"><Discovery><ParticipantIndex>none</ParticipantIndex></Discovery></Domain></CycloneDDS>";

// What the environment says.
std::string given_settings() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here writes the environment
  const char* given = std::getenv("CYCLONEDDS_URI");
  return given == nullptr ? "" : given;
}

// The domain with no index asked for; none where it was not the index that was wanting.
Entity domain_without_index(dds_domainid_t id) {
  const std::string given = given_settings();
  // Cyclone does not say why it makes no participant: but without an index, it makes no domain either.
  if (const Entity made(dds_create_domain(id, given.c_str())); made.get() > 0) return {};
  return Entity(dds_create_domain(id, (given.empty() ? kWithoutIndex : given + "," + kWithoutIndex).c_str()));
}

}  // namespace

Expected<Participant> Participant::create(const Membership& membership) {
  const auto domain = static_cast<dds_domainid_t>(membership.domain);
  const Qos qos = membership.security ? secured_qos(*membership.security) : Qos();
  Entity participant(dds_create_participant(domain, qos.get(), nullptr));
  if (participant.get() > 0) return Participant(Entity(), std::move(participant));
  const dds_return_t first = participant.get();
  if (Entity made = first == DDS_RETCODE_ERROR ? domain_without_index(domain) : Entity(); made.get() > 0) {
    participant = Entity(dds_create_participant(domain, qos.get(), nullptr));
    if (participant.get() > 0) return Participant(std::move(made), std::move(participant));
  }
  return fail(fmt::format("DDS domain {}{}: cannot join: {}", membership.domain,
                          membership.security ? fmt::format(" with the keys of {}", membership.security->string()) : "",
                          dds_strretcode(first)));
}

}  // namespace perimap::dds
