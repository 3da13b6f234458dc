#include "daemon/dds/sample_readers.hpp"

#include <utility>
#include <vector>

namespace perimap {

Expected<SampleReaders> SampleReaders::create(const dds::Membership& membership, bool all_topics, bool with_tools) {
  auto participant = dds::Participant::create(membership);
  if (!participant) {
    return tl::unexpected(participant.error());
  }
  auto surfaces = dds::Reader<perimap_Surface>::create(*participant);
  auto models = dds::Reader<perimap_SurfaceModel>::create(*participant);
  auto meshes = dds::Reader<perimap_SurfaceMesh>::create(*participant);
  auto phases = dds::Reader<perimap_Phase>::create(*participant);
  auto statuses = dds::Reader<perimap_Status>::create(*participant);
  auto wait_set = dds::WaitSet::create(*participant);
  const auto error_of = [](const auto& result) { return result ? Error{} : result.error(); };
  for (const Error& error : {error_of(surfaces), error_of(models), error_of(meshes), error_of(phases),
                             error_of(statuses), error_of(wait_set)}) {
    if (!error.message.empty()) {
      return tl::unexpected(error);
    }
  }
  std::vector<dds_entity_t> conditions{surfaces->condition(), statuses->condition()};
  if (all_topics) {
    conditions.insert(conditions.end(), {models->condition(), meshes->condition(), phases->condition()});
  }
  std::optional<dds::Reader<perimap_ToolDistance>> tools;
  if (with_tools) {
    auto created = dds::Reader<perimap_ToolDistance>::create(*participant);
    if (!created && !membership.security) return tl::unexpected(created.error());
    if (created) {
      conditions.push_back(created->condition());
      tools.emplace(std::move(*created));
    }
  }
  for (const dds_entity_t condition : conditions) {
    if (auto attached = wait_set->attach(condition); !attached) {
      return tl::unexpected(attached.error());
    }
  }
  return SampleReaders{std::move(*participant), std::move(*surfaces), std::move(*models), std::move(*meshes),
                       std::move(*phases),      std::move(*statuses), std::move(tools),   std::move(*wait_set)};
}

}  // namespace perimap
