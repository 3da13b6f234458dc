#include "daemon/dds/topic.hpp"

namespace perimap::dds {
namespace {

// The longest that a reliable write may wait for a slow reader. Keep last 1 replaces what was not taken, so waiting is
// the exception; a publisher must not hang on it.
constexpr Duration kLongestBlocking = std::chrono::milliseconds(10);

Qos topic_qos(const TopicDescription& topic) {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), topic.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       kLongestBlocking.count());
  dds_qset_durability(qos.get(), topic.reliable ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  return qos;
}

}  // namespace

template <>
const TopicDescription& topic_of<perimap_Surface>() noexcept {
  static const TopicDescription topic{"perimap/surface", &perimap_Surface_desc, false};
  return topic;
}

template <>
const TopicDescription& topic_of<perimap_SurfaceModel>() noexcept {
  static const TopicDescription topic{"perimap/surface_model", &perimap_SurfaceModel_desc, true};
  return topic;
}

template <>
const TopicDescription& topic_of<perimap_SurfaceMesh>() noexcept {
  static const TopicDescription topic{"perimap/surface_mesh", &perimap_SurfaceMesh_desc, true};
  return topic;
}

template <>
const TopicDescription& topic_of<perimap_ToolDistance>() noexcept {
  static const TopicDescription topic{"perimap/tool", &perimap_ToolDistance_desc, false};
  return topic;
}

template <>
const TopicDescription& topic_of<perimap_Phase>() noexcept {
  static const TopicDescription topic{"perimap/phase", &perimap_Phase_desc, false};
  return topic;
}

template <>
const TopicDescription& topic_of<perimap_Status>() noexcept {
  static const TopicDescription topic{"perimap/status", &perimap_Status_desc, true};
  return topic;
}

template <>
const TopicDescription& topic_of<perimap_Guidance>() noexcept {
  static const TopicDescription topic{"perimap/guidance", &perimap_Guidance_desc, false};
  return topic;
}

Qos writer_qos(const TopicDescription& topic, const WriterPromise& promise) {
  Qos qos = topic_qos(topic);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  if (promise.deadline > Duration(0)) {
    dds_qset_deadline(qos.get(), promise.deadline.count());
  }
  if (promise.lifespan > Duration(0)) {
    dds_qset_lifespan(qos.get(), promise.lifespan.count());
  }
  return qos;
}

Qos reader_qos(const TopicDescription& topic, int depth, Hears hears) {
  Qos qos = topic_qos(topic);
  if (hears == Hears::kOthers) dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  return qos;
}

}  // namespace perimap::dds
