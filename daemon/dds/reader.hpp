// Receives samples of one topic.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/error/expected.hpp"
#include "daemon/dds/entity.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/dds/topic.hpp"

namespace perimap::dds {

// Enough for the threads' pauses of a loaded host at hundreds of samples a second.
inline constexpr int kReaderDepth = 16;

// Samples lent by a reader; they go back when this is destroyed, which must be before the reader is.
class UntypedLoan {
 public:
  UntypedLoan() = default;
  UntypedLoan(UntypedLoan&& other) noexcept;
  UntypedLoan& operator=(UntypedLoan&&) = delete;
  UntypedLoan(const UntypedLoan&) = delete;
  UntypedLoan& operator=(const UntypedLoan&) = delete;
  ~UntypedLoan();

  [[nodiscard]] std::size_t size() const noexcept { return static_cast<std::size_t>(count_); }
  [[nodiscard]] const void* sample(std::size_t i) const noexcept { return samples_[i]; }
  [[nodiscard]] const dds_sample_info_t& info(std::size_t i) const noexcept { return infos_[i]; }

 private:
  friend class UntypedReader;

  dds_entity_t reader_ = 0;
  std::int32_t count_ = 0;
  std::array<void*, kReaderDepth> samples_{};
  std::array<dds_sample_info_t, kReaderDepth> infos_{};
};

// What does not depend on the type of the samples.
class UntypedReader {
 public:
  [[nodiscard]] static Expected<UntypedReader> create(const Participant& participant,
                                                      const TopicDescription& description, int depth, Hears hears);

  [[nodiscard]] Expected<UntypedLoan> take();
  // A condition that holds while there is something to take: for a WaitSet.
  [[nodiscard]] dds_entity_t condition() const noexcept { return condition_.get(); }
  // Writers that are connected now.
  [[nodiscard]] int matched_writers() const noexcept;
  // Whose writer it is (dds_sample_info_t::publication_handle): the same number for all writers of one participant.
  // None when the writer has gone.
  [[nodiscard]] std::optional<std::uint64_t> participant_of(dds_instance_handle_t writer) const noexcept;

 private:
  UntypedReader(Entity topic, Entity reader, Entity condition) noexcept
      : topic_(std::move(topic)), reader_(std::move(reader)), condition_(std::move(condition)) {}

  Entity topic_;
  Entity reader_;
  Entity condition_;
};

// Up to kReaderDepth samples in the order of their arrival, for each key.
template <class T>
class Loan {
 public:
  explicit Loan(UntypedLoan loan) noexcept : loan_(std::move(loan)) {}

  [[nodiscard]] std::size_t size() const noexcept { return loan_.size(); }
  // Null when the entry only tells that a writer has gone.
  [[nodiscard]] const T* sample(std::size_t i) const noexcept {
    return loan_.info(i).valid_data ? static_cast<const T*>(loan_.sample(i)) : nullptr;
  }
  [[nodiscard]] const dds_sample_info_t& info(std::size_t i) const noexcept { return loan_.info(i); }

 private:
  UntypedLoan loan_;
};

// T: a published type of perimap.idl. One thread at a time.
template <class T>
class Reader {
 public:
  [[nodiscard]] static Expected<Reader> create(const Participant& participant, int depth = kReaderDepth,
                                               Hears hears = Hears::kAll) {
    return UntypedReader::create(participant, topic_of<T>(), depth, hears).map([](UntypedReader reader) {
      return Reader(std::move(reader));
    });
  }

  // What has arrived since the last take; empty when nothing has. Never blocks.
  [[nodiscard]] Expected<Loan<T>> take() {
    return reader_.take().map([](UntypedLoan loan) { return Loan<T>(std::move(loan)); });
  }
  [[nodiscard]] dds_entity_t condition() const noexcept { return reader_.condition(); }
  [[nodiscard]] int matched_writers() const noexcept { return reader_.matched_writers(); }
  [[nodiscard]] std::optional<std::uint64_t> participant_of(dds_instance_handle_t writer) const noexcept {
    return reader_.participant_of(writer);
  }

 private:
  explicit Reader(UntypedReader reader) noexcept : reader_(std::move(reader)) {}

  UntypedReader reader_;
};

}  // namespace perimap::dds
