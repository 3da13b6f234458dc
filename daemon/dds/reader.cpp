#include "daemon/dds/reader.hpp"

#include <fmt/format.h>

namespace perimap::dds {

UntypedLoan::UntypedLoan(UntypedLoan&& other) noexcept
    : reader_(other.reader_), count_(std::exchange(other.count_, 0)), samples_(other.samples_), infos_(other.infos_) {}

UntypedLoan::~UntypedLoan() {
  if (count_ > 0) {
    dds_return_loan(reader_, samples_.data(), count_);
  }
}

Expected<UntypedReader> UntypedReader::create(const Participant& participant, const TopicDescription& description,
                                              int depth, Hears hears) {
  Entity topic(dds_create_topic(participant.handle(), description.descriptor, description.name, nullptr, nullptr));
  if (topic.get() < 0) {
    return fail(fmt::format("DDS topic {}: cannot create: {}", description.name, dds_strretcode(topic.get())));
  }
  const Qos qos = reader_qos(description, depth, hears);
  Entity reader(dds_create_reader(participant.handle(), topic.get(), qos.get(), nullptr));
  if (reader.get() < 0) {
    return fail(
        fmt::format("DDS topic {}: cannot create a reader: {}", description.name, dds_strretcode(reader.get())));
  }
  Entity condition(dds_create_readcondition(reader.get(), DDS_ANY_STATE));
  if (condition.get() < 0) {
    return fail(
        fmt::format("DDS topic {}: cannot create a condition: {}", description.name, dds_strretcode(condition.get())));
  }
  return UntypedReader(std::move(topic), std::move(reader), std::move(condition));
}

Expected<UntypedLoan> UntypedReader::take() {
  UntypedLoan loan;
  loan.reader_ = reader_.get();
  // A null first pointer asks for samples on loan.
  const dds_return_t count =
      dds_take(reader_.get(), loan.samples_.data(), loan.infos_.data(), loan.samples_.size(), kReaderDepth);
  if (count < 0) {
    return fail(fmt::format("DDS take: {}", dds_strretcode(count)));
  }
  loan.count_ = count;
  return loan;
}

int UntypedReader::matched_writers() const noexcept {
  dds_subscription_matched_status_t status{};
  return dds_get_subscription_matched_status(reader_.get(), &status) < 0 ? 0 : static_cast<int>(status.current_count);
}

std::optional<std::uint64_t> UntypedReader::participant_of(dds_instance_handle_t writer) const noexcept {
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader_.get(), writer);
  if (endpoint == nullptr) return std::nullopt;
  const std::uint64_t participant = endpoint->participant_instance_handle;
  dds_builtintopic_free_endpoint(endpoint);
  return participant;
}

}  // namespace perimap::dds
