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
  auto refused = std::make_unique<Refused>();
  const std::unique_ptr<dds_listener_t, void (*)(dds_listener_t*)> listener(dds_create_listener(refused.get()),
                                                                            dds_delete_listener);
  dds_lset_offered_incompatible_qos(listener.get(),
                                    [](dds_entity_t, const dds_offered_incompatible_qos_status_t status, void* counts) {
                                      auto* const to = static_cast<Refused*>(counts);
                                      to->ever.store(status.total_count, std::memory_order_relaxed);
                                      to->policy.store(status.last_policy_id, std::memory_order_relaxed);
                                    });
  Entity writer(dds_create_writer(participant.handle(), topic.get(), qos.get(), listener.get()));
  if (writer.get() < 0) {
    return fail(
        fmt::format("DDS topic {}: cannot create a writer: {}", description.name, dds_strretcode(writer.get())));
  }
  return UntypedWriter(std::move(refused), std::move(topic), std::move(writer));
}

int UntypedWriter::matched_readers() const noexcept {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writer_.get(), &status) < 0 ? 0 : static_cast<int>(status.current_count);
}

RefusedReaders UntypedWriter::refused_readers() const noexcept {
  return {refused_->ever.load(std::memory_order_relaxed),
          static_cast<dds_qos_policy_id_t>(refused_->policy.load(std::memory_order_relaxed))};
}

}  // namespace perimap::dds
