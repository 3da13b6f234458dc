// The published topics: their names, types and qualities of service.
#pragma once

#include <dds/dds.h>

#include <memory>

#include "core/time/instant.hpp"

extern "C" {
#include "perimap.h"
#include "perimap_guidance.h"
#include "perimap_mesh.h"
#include "perimap_tool.h"
}

namespace perimap::dds {

struct TopicDescription {
  const char* name;
  const dds_topic_descriptor_t* descriptor;
  // Reliable and transient local: a late reader gets the last sample. Otherwise best effort and volatile: a prediction
  // that comes late is worth nothing, so none is sent twice.
  bool reliable;
};

// The topic of a published type.
template <class T>
[[nodiscard]] const TopicDescription& topic_of() noexcept;
template <>
[[nodiscard]] const TopicDescription& topic_of<perimap_Surface>() noexcept;
template <>
[[nodiscard]] const TopicDescription& topic_of<perimap_SurfaceModel>() noexcept;
template <>
[[nodiscard]] const TopicDescription& topic_of<perimap_SurfaceMesh>() noexcept;
template <>
[[nodiscard]] const TopicDescription& topic_of<perimap_ToolDistance>() noexcept;
template <>
[[nodiscard]] const TopicDescription& topic_of<perimap_Phase>() noexcept;
template <>
[[nodiscard]] const TopicDescription& topic_of<perimap_Status>() noexcept;
template <>
[[nodiscard]] const TopicDescription& topic_of<perimap_Guidance>() noexcept;

struct DeleteQos {
  void operator()(dds_qos_t* qos) const noexcept { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, DeleteQos>;

// What a writer promises beyond its topic. Zero means no promise; a deadline of zero would crash Cyclone DDS 0.10.
struct WriterPromise {
  Duration deadline{0};
  Duration lifespan{0};
};

// Keep last 1.
[[nodiscard]] Qos writer_qos(const TopicDescription& topic, const WriterPromise& promise);
// Whose samples a reader gets: everyone's, or those of other participants alone.
enum class Hears { kAll, kOthers };

// Keep last `depth` (of each key).
[[nodiscard]] Qos reader_qos(const TopicDescription& topic, int depth, Hears hears = Hears::kAll);

}  // namespace perimap::dds
