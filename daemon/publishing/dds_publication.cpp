#include "daemon/publishing/dds_publication.hpp"

#include <spdlog/spdlog.h>

namespace perimap {

Expected<std::unique_ptr<DdsPublication>> DdsPublication::create(const DdsSettings& settings) {
  auto participant = dds::Participant::create(settings.membership);
  if (!participant) return tl::unexpected(participant.error());
  auto surface =
      dds::Writer<perimap_Surface>::create(*participant, {settings.surface_deadline, settings.surface_lifespan});
  if (!surface) return tl::unexpected(surface.error());
  auto model = dds::Writer<perimap_SurfaceModel>::create(*participant);
  if (!model) return tl::unexpected(model.error());
  auto mesh = dds::Writer<perimap_SurfaceMesh>::create(*participant);
  if (!mesh) return tl::unexpected(mesh.error());
  std::optional<dds::Writer<perimap_ToolDistance>> tool;
  if (settings.tools) {
    auto created = dds::Writer<perimap_ToolDistance>::create(*participant);
    if (!created) return tl::unexpected(created.error());
    tool.emplace(std::move(*created));
  }
  auto phase = dds::Writer<perimap_Phase>::create(*participant);
  if (!phase) return tl::unexpected(phase.error());
  auto status = dds::Writer<perimap_Status>::create(*participant);
  if (!status) return tl::unexpected(status.error());
  std::optional<NameWatch> name_watch;
  if (!settings.identity.source.empty()) {
    auto watch = NameWatch::create(*participant, settings.identity);
    if (!watch) return tl::unexpected(watch.error());
    name_watch.emplace(std::move(*watch));
  }
  if (participant->without_index()) {
    spdlog::warn(
        "other processes have every participant index of DDS domain {}: publishing without one; subscribers that have "
        "one are found, others are not",
        settings.membership.domain);
  }
  return std::unique_ptr<DdsPublication>(
      new DdsPublication(settings, std::move(*participant), std::move(*surface), std::move(*model), std::move(*mesh),
                         std::move(tool), std::move(*phase), std::move(*status), std::move(name_watch)));
}

// Ten times a second.
void DdsPublication::phase(const perimap_Phase& phase) {
  count(phase_.write(phase));
  tell_another_publisher();
}

void DdsPublication::status(const perimap_Status& status) {
  count(status_.write(status));
  tell_failures();
  tell_refused_readers();
}

void DdsPublication::count(dds_return_t written) noexcept {
  if (written >= 0) return;
  last_error_.store(written, std::memory_order_relaxed);
  failures_.fetch_add(1, std::memory_order_relaxed);
}

void DdsPublication::tell_another_publisher() {
  if (!name_watch_) return;
  const Instant now = MonotonicClock::now();
  name_watch_->look(now);
  const bool another = name_watch_->another(now);
  if (another == another_publisher_.load(std::memory_order_relaxed)) return;
  another_publisher_.store(another, std::memory_order_relaxed);
  if (another) {
    spdlog::error(
        "TWO PUBLISHERS: another program publishes as source '{}' in DDS domain {}; subscribers must use neither. Stop "
        "it, "
        "or give one of them another source.name",
        settings_.identity.source, settings_.membership.domain);
  } else {
    spdlog::info("nobody else publishes as source '{}' any more", settings_.identity.source);
  }
}

void DdsPublication::tell_refused_readers() {
  const Instant now = MonotonicClock::now();
  auto look_at = [&, watch = reader_watches_.begin()](const auto& writer, const dds::TopicDescription& topic) mutable {
    (watch++)->look(topic.name, writer.refused_readers(), now);
  };
  look_at(surface_, dds::topic_of<perimap_Surface>());
  look_at(model_, dds::topic_of<perimap_SurfaceModel>());
  look_at(mesh_, dds::topic_of<perimap_SurfaceMesh>());
  look_at(phase_, dds::topic_of<perimap_Phase>());
  look_at(status_, dds::topic_of<perimap_Status>());
  if (tool_) look_at(*tool_, dds::topic_of<perimap_ToolDistance>());
}

void DdsPublication::tell_failures() {
  const Instant now = MonotonicClock::now();
  const std::uint64_t failures = this->failures();
  if (failures > failures_seen_) {
    if (!failing_) {
      spdlog::error("DDS writes fail: {}", dds_strretcode(last_error_.load(std::memory_order_relaxed)));
      failures_before_ = failures_seen_;
    }
    failing_ = true;
    last_seen_ = now;
    failures_seen_ = failures;
  } else if (failing_ && now - last_seen_ >= settings_.writes_well_after) {
    spdlog::warn("DDS writes succeed again; {} failed", failures - failures_before_);
    failing_ = false;
  }
}

}  // namespace perimap
