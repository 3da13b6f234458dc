// Membership of one DDS domain.
#pragma once

#include <filesystem>
#include <optional>

#include "core/error/expected.hpp"
#include "daemon/dds/entity.hpp"

namespace perimap::dds {

// Which domain, and with which keys.
struct Membership {
  int domain = 0;  // 0 to 230
  // A folder as `perimap keys issue` makes it; none: without DDS Security.
  std::optional<std::filesystem::path> security;

  // NOLINTNEXTLINE(google-explicit-constructor): a domain by itself is a membership
  Membership(int of, std::optional<std::filesystem::path> keys = std::nullopt)
      : domain(of), security(std::move(keys)) {}
};

// Must outlive the writers, readers and wait sets made from it. Network interface, peers and buffers come from the
// file that the environment variable CYCLONEDDS_URI names (deploy/cyclonedds-loopback.xml is one).
class Participant {
 public:
  // Where other processes have every participant index of the domain, which any user of this host can bring about, it
  // joins without one: those with an index find it all the same, since it asks at their ports.
  [[nodiscard]] static Expected<Participant> create(const Membership& membership);

  [[nodiscard]] dds_entity_t handle() const noexcept { return entity_.get(); }
  // No index was left: others without one are not found.
  [[nodiscard]] bool without_index() const noexcept { return domain_.get() > 0; }

 private:
  Participant(Entity domain, Entity entity) noexcept : domain_(std::move(domain)), entity_(std::move(entity)) {}

  Entity domain_;  // where it had to be made with other settings
  Entity entity_;
};

}  // namespace perimap::dds
