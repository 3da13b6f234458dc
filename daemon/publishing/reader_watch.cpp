#include "daemon/publishing/reader_watch.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace perimap {
namespace {

constexpr Duration kSayAgain = std::chrono::minutes(1);

}  // namespace

std::string refusal_words(std::string_view topic, dds_qos_policy_id_t policy) {
  switch (policy) {
    case DDS_DATA_REPRESENTATION_QOS_POLICY_ID:
      if (topic == dds::topic_of<perimap_SurfaceMesh>().name)
        return "it reads another representation than this topic's, XCDR1";
      return "it reads another representation (XCDR1 alone, as Fast DDS 2 does) than this topic's, XCDR2: take "
             "perimap/surface_mesh, which all vendors read, or perimap bridge ros2";
    case DDS_RELIABILITY_QOS_POLICY_ID:
      return "it asks for a reliable topic, and this one is best effort: ask for best effort";
    case DDS_DURABILITY_QOS_POLICY_ID:
      return "it asks for samples from before its time, and this topic keeps fewer: ask for a lesser durability";
    case DDS_DEADLINE_QOS_POLICY_ID:
      return "it asks for samples more often than is promised: ask for a longer deadline, or for none";
    case DDS_OWNERSHIP_QOS_POLICY_ID:
      return "it asks for exclusive ownership, and this topic is shared";
    default:
      return fmt::format("policy {} of DDS does not fit", static_cast<int>(policy));
  }
}

void ReaderWatch::look(const char* topic, const dds::RefusedReaders& refused, Instant now) {
  if (refused.ever == told_ || (said_ && now - last_said_ < kSayAgain)) return;
  const std::uint32_t fresh = refused.ever - told_;
  told_ = refused.ever;
  said_ = true;
  last_said_ = now;
  spdlog::warn("{} of {} {} nothing: {}", fresh == 1 ? "a reader" : fmt::format("{} readers", fresh), topic,
               fresh == 1 ? "gets" : "get", refusal_words(topic, refused.policy));
}

}  // namespace perimap
