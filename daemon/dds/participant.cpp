#include "daemon/dds/participant.hpp"

#include <fmt/format.h>

namespace perimap::dds {

Expected<Participant> Participant::create(int domain) {
  const dds_entity_t handle = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
  if (handle < 0) {
    return fail(fmt::format("DDS domain {}: cannot join: {}", domain, dds_strretcode(handle)));
  }
  return Participant(Entity(handle));
}

}  // namespace perimap::dds
