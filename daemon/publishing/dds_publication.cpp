#include "daemon/publishing/dds_publication.hpp"

#include <spdlog/spdlog.h>

namespace perimap {

Expected<std::unique_ptr<DdsPublication>> DdsPublication::create(const DdsSettings& settings) {
  auto participant = dds::Participant::create(settings.domain);
  if (!participant) return tl::unexpected(participant.error());
  auto surface =
      dds::Writer<perimap_Surface>::create(*participant, {settings.surface_deadline, settings.surface_lifespan});
  if (!surface) return tl::unexpected(surface.error());
  auto model = dds::Writer<perimap_SurfaceModel>::create(*participant);
  if (!model) return tl::unexpected(model.error());
  auto phase = dds::Writer<perimap_Phase>::create(*participant);
  if (!phase) return tl::unexpected(phase.error());
  auto status = dds::Writer<perimap_Status>::create(*participant);
  if (!status) return tl::unexpected(status.error());
  return std::unique_ptr<DdsPublication>(new DdsPublication(std::move(*participant), std::move(*surface),
                                                            std::move(*model), std::move(*phase), std::move(*status)));
}

void DdsPublication::count(const Expected<void>& written) {
  if (written) return;
  if (failures_.fetch_add(1, std::memory_order_relaxed) == 0) {
    spdlog::error("DDS write failed (further ones are counted): {}", written.error().message);
  }
}

}  // namespace perimap
