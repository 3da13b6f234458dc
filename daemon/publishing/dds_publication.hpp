// Publishes over DDS.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/error/expected.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/dds/writer.hpp"
#include "daemon/publishing/publication.hpp"

namespace perimap {

struct DdsSettings {
  int domain = 0;
  Duration surface_deadline{0};  // offered period of `surface`; 0: none
  Duration surface_lifespan{0};  // 0: none
};

// A write that fails is counted, and the first one is logged: the next sample is a new chance.
class DdsPublication final : public Publication {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<DdsPublication>> create(const DdsSettings& settings);

  void surface(const perimap_Surface& sample) override { count(surface_.write(sample)); }
  void surface_model(const perimap_SurfaceModel& model) override { count(model_.write(model)); }
  void phase(const perimap_Phase& phase) override { count(phase_.write(phase)); }
  void status(const perimap_Status& status) override { count(status_.write(status)); }

  // Samples that could not be written.
  [[nodiscard]] std::uint64_t failures() const noexcept { return failures_.load(std::memory_order_relaxed); }

 private:
  DdsPublication(dds::Participant participant, dds::Writer<perimap_Surface> surface,
                 dds::Writer<perimap_SurfaceModel> model, dds::Writer<perimap_Phase> phase,
                 dds::Writer<perimap_Status> status)
      : participant_(std::move(participant)),
        surface_(std::move(surface)),
        model_(std::move(model)),
        phase_(std::move(phase)),
        status_(std::move(status)) {}

  void count(const Expected<void>& written);

  dds::Participant participant_;
  dds::Writer<perimap_Surface> surface_;
  dds::Writer<perimap_SurfaceModel> model_;
  dds::Writer<perimap_Phase> phase_;
  dds::Writer<perimap_Status> status_;
  // Relaxed: a statistic that orders nothing. Two threads publish, so it is added to atomically.
  std::atomic<std::uint64_t> failures_{0};
};

}  // namespace perimap
