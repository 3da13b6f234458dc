// Publishes over DDS.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/dds/writer.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/publishing/name_watch.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/publishing/reader_watch.hpp"

namespace perimap {

struct DdsSettings {
  dds::Membership membership = 0;
  Duration surface_deadline{0};  // offered period of `surface`; 0: none
  Duration surface_lifespan{0};  // 0: none
  // There are tools to tell of: keys of DDS Security that were issued before there was the topic lack it, and go on to
  // be enough for those who have none.
  bool tools = false;
  // So long without a failure: writes succeed again, for the log.
  Duration writes_well_after = std::chrono::seconds(5);
  // Who publishes: another that does under this name is told. Without a source nobody is looked for.
  Identity identity{};
};

// A write that fails is counted: the next sample is a new chance. The log has a line when it begins and when it ends,
// from the thread that publishes the status.
class DdsPublication final : public Publication {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<DdsPublication>> create(const DdsSettings& settings);

  void surface(const perimap_Surface& sample) override { count(surface_.write(sample)); }
  void surface_model(const perimap_SurfaceModel& model) override { count(model_.write(model)); }
  void surface_mesh(const perimap_SurfaceMesh& mesh) override { count(mesh_.write(mesh)); }
  void tool(const perimap_ToolDistance& distance) override {
    if (tool_) count(tool_->write(distance));
  }
  void phase(const perimap_Phase& phase) override;
  void status(const perimap_Status& status) override;
  [[nodiscard]] bool another_publisher() const noexcept override {
    return another_publisher_.load(std::memory_order_relaxed);
  }

  // Samples that could not be written.
  [[nodiscard]] std::uint64_t failures() const noexcept { return failures_.load(std::memory_order_relaxed); }

 private:
  DdsPublication(const DdsSettings& settings, dds::Participant participant, dds::Writer<perimap_Surface> surface,
                 dds::Writer<perimap_SurfaceModel> model, dds::Writer<perimap_SurfaceMesh> mesh,
                 std::optional<dds::Writer<perimap_ToolDistance>> tool, dds::Writer<perimap_Phase> phase,
                 dds::Writer<perimap_Status> status, std::optional<NameWatch> name_watch)
      : settings_(settings),
        participant_(std::move(participant)),
        surface_(std::move(surface)),
        model_(std::move(model)),
        mesh_(std::move(mesh)),
        tool_(std::move(tool)),
        phase_(std::move(phase)),
        status_(std::move(status)),
        name_watch_(std::move(name_watch)) {}

  void count(dds_return_t written) noexcept;
  void tell_failures();
  void tell_another_publisher();
  void tell_refused_readers();

  DdsSettings settings_;
  dds::Participant participant_;
  dds::Writer<perimap_Surface> surface_;
  dds::Writer<perimap_SurfaceModel> model_;
  dds::Writer<perimap_SurfaceMesh> mesh_;
  std::optional<dds::Writer<perimap_ToolDistance>> tool_;  // without tools there is none
  dds::Writer<perimap_Phase> phase_;
  dds::Writer<perimap_Status> status_;
  std::optional<NameWatch> name_watch_;  // the status thread's own
  // Relaxed: a statistic that orders nothing.
  std::atomic<bool> another_publisher_{false};
  // Relaxed: a statistic that orders nothing. Three threads publish, so it is added to atomically.
  std::atomic<std::uint64_t> failures_{0};
  std::atomic<dds_return_t> last_error_{DDS_RETCODE_OK};
  // The status thread's own.
  std::array<ReaderWatch, 6> reader_watches_;  // one a topic
  bool failing_ = false;
  Instant last_seen_;  // that one had failed
  std::uint64_t failures_seen_ = 0;
  std::uint64_t failures_before_ = 0;  // when it began
};

}  // namespace perimap
