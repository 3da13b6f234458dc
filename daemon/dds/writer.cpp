#include "daemon/dds/writer.hpp"

#include <fmt/format.h>

namespace perimap::dds {

Expected<UntypedWriter> UntypedWriter::create(const Participant& participant, const TopicDescription& description,
                                              const WriterPromise& promise) {
  Entity topic(dds_create_topic(participant.handle(), description.descriptor, description.name, nullptr, nullptr));
  if (topic.get() < 0) {
    return fail(fmt::format("DDS topic {}: cannot create: {}", description.name, dds_strretcode(topic.get())));
  }
  const Qos qos = writer_qos(description, promise);
  Entity writer(dds_create_writer(participant.handle(), topic.get(), qos.get(), nullptr));
  if (writer.get() < 0) {
    return fail(
        fmt::format("DDS topic {}: cannot create a writer: {}", description.name, dds_strretcode(writer.get())));
  }
  return UntypedWriter(std::move(topic), std::move(writer));
}

int UntypedWriter::matched_readers() const noexcept {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writer_.get(), &status) < 0 ? 0 : static_cast<int>(status.current_count);
}

RefusedReaders UntypedWriter::refused_readers() const noexcept {
  dds_offered_incompatible_qos_status_t status{};
  if (dds_get_offered_incompatible_qos_status(writer_.get(), &status) < 0) return {};
  return {status.total_count, static_cast<dds_qos_policy_id_t>(status.last_policy_id)};
}

}  // namespace perimap::dds
