// Whether another program publishes under this one's name.
#pragma once

#include <atomic>
#include <string>
#include <tuple>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/dds/reader.hpp"
#include "daemon/publishing/identity.hpp"

namespace perimap {

// Reads all topics of a domain but for what its own participant writes, which therefore costs the publisher nothing. In
// a domain without DDS Security anyone can take any name, on purpose or because two machines have one configuration.
class NameWatch {
 public:
  [[nodiscard]] static Expected<NameWatch> create(const dds::Participant& participant, const Identity& identity);

  // Takes what has come. One thread at a time.
  void look(Instant now);
  // Another was heard within the last seconds. After look().
  [[nodiscard]] bool another(Instant now) const noexcept { return heard_ && now - last_heard_ < kHeld; }

 private:
  static constexpr Duration kHeld = std::chrono::seconds(2);

  using Readers = std::tuple<dds::Reader<perimap_Surface>, dds::Reader<perimap_SurfaceModel>,
                             dds::Reader<perimap_SurfaceMesh>, dds::Reader<perimap_Phase>, dds::Reader<perimap_Status>>;

  NameWatch(Readers readers, Identity identity) : readers_(std::move(readers)), identity_(std::move(identity)) {}

  Readers readers_;
  Identity identity_;
  bool heard_ = false;
  Instant last_heard_;
};

}  // namespace perimap
