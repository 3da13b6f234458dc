// Membership of one DDS domain.
#pragma once

#include "core/error/expected.hpp"
#include "daemon/dds/entity.hpp"

namespace perimap::dds {

// Must outlive the writers, readers and wait sets made from it. Network interface, peers and buffers come from the
// file that the environment variable CYCLONEDDS_URI names (deploy/cyclonedds-loopback.xml is one).
class Participant {
 public:
  // domain: 0 to 230.
  [[nodiscard]] static Expected<Participant> create(int domain);

  [[nodiscard]] dds_entity_t handle() const noexcept { return entity_.get(); }

 private:
  explicit Participant(Entity entity) noexcept : entity_(std::move(entity)) {}

  Entity entity_;
};

}  // namespace perimap::dds
