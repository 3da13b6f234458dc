#include "daemon/publishing/name_watch.hpp"

#include <utility>

namespace perimap {

Expected<NameWatch> NameWatch::create(const dds::Participant& participant, const Identity& identity) {
  constexpr int kDepth = 1;
  const auto others = dds::Hears::kOthers;
  auto surfaces = dds::Reader<perimap_Surface>::create(participant, kDepth, others);
  if (!surfaces) return tl::unexpected(surfaces.error());
  auto models = dds::Reader<perimap_SurfaceModel>::create(participant, kDepth, others);
  if (!models) return tl::unexpected(models.error());
  auto meshes = dds::Reader<perimap_SurfaceMesh>::create(participant, kDepth, others);
  if (!meshes) return tl::unexpected(meshes.error());
  auto phases = dds::Reader<perimap_Phase>::create(participant, kDepth, others);
  if (!phases) return tl::unexpected(phases.error());
  auto statuses = dds::Reader<perimap_Status>::create(participant, kDepth, others);
  if (!statuses) return tl::unexpected(statuses.error());
  return NameWatch(
      {std::move(*surfaces), std::move(*models), std::move(*meshes), std::move(*phases), std::move(*statuses)},
      identity);
}

void NameWatch::look(Instant now) {
  const auto look_at = [&](auto& reader) {
    const auto loan = reader.take();
    for (std::size_t i = 0; loan && i < loan->size(); ++i) {
      const auto* sample = loan->sample(i);
      if (sample == nullptr || identity_.source != sample->source) continue;
      heard_ = true;
      last_heard_ = now;
    }
  };
  std::apply([&look_at](auto&... readers) { (look_at(readers), ...); }, readers_);
}

}  // namespace perimap
