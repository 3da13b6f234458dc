// Readers of everything that perimapd publishes, and what wakes a thread that empties them.
#pragma once

#include <optional>

#include "core/error/expected.hpp"
#include "daemon/dds/reader.hpp"
#include "daemon/dds/wait_set.hpp"

namespace perimap {

// Readers in one participant.
struct SampleReaders {
  dds::Participant participant;
  dds::Reader<perimap_Surface> surfaces;
  dds::Reader<perimap_SurfaceModel> models;
  dds::Reader<perimap_SurfaceMesh> meshes;
  dds::Reader<perimap_Phase> phases;
  dds::Reader<perimap_Status> statuses;
  // Where they were asked for, and may be read: keys of DDS Security that were issued before there was the topic lack
  // it.
  std::optional<dds::Reader<perimap_ToolDistance>> tools;
  dds::WaitSet wait_set;

  // Without `all_topics` only surfaces and statuses wake the thread; the others are not read.
  // `with_tools`: distances of tools wake it too.
  [[nodiscard]] static Expected<SampleReaders> create(const dds::Membership& membership, bool all_topics,
                                                      bool with_tools = false);
};

}  // namespace perimap
