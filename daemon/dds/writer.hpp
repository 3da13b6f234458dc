// Publishes samples of one topic.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "core/error/expected.hpp"
#include "daemon/dds/entity.hpp"
#include "daemon/dds/participant.hpp"
#include "daemon/dds/topic.hpp"

namespace perimap::dds {

// Readers that asked for what a writer does not offer, and therefore get nothing.
struct RefusedReaders {
  std::uint32_t ever = 0;
  dds_qos_policy_id_t policy = DDS_INVALID_QOS_POLICY_ID;  // of the last one: what did not fit
};

// What does not depend on the type of the samples.
class UntypedWriter {
 public:
  [[nodiscard]] static Expected<UntypedWriter> create(const Participant& participant,
                                                      const TopicDescription& description,
                                                      const WriterPromise& promise);

  // Copies the sample to the network and to readers in this process. Allocates, locks and calls the kernel. Returns
  // DDS_RETCODE_OK or a negative code, which dds_strretcode() names: a sentence about it would be made on the publisher
  // thread.
  [[nodiscard]] dds_return_t write(const void* sample) noexcept { return dds_write(writer_.get(), sample); }
  // Readers that are connected now.
  [[nodiscard]] int matched_readers() const noexcept;
  // Any thread; takes no lock of the writer's.
  [[nodiscard]] RefusedReaders refused_readers() const noexcept;

 private:
  // Relaxed: each is a hint by itself. Written by a thread of DDS.
  struct Refused {
    std::atomic<std::uint32_t> ever{0};
    std::atomic<std::uint32_t> policy{DDS_INVALID_QOS_POLICY_ID};
  };
  UntypedWriter(std::unique_ptr<Refused> refused, Entity topic, Entity writer) noexcept
      : refused_(std::move(refused)), topic_(std::move(topic)), writer_(std::move(writer)) {}

  std::unique_ptr<Refused> refused_;  // goes after the writer, whose thread writes it
  Entity topic_;
  Entity writer_;
};

// T: a published type of perimap.idl. One thread at a time.
template <class T>
class Writer {
 public:
  [[nodiscard]] static Expected<Writer> create(const Participant& participant, const WriterPromise& promise = {}) {
    return UntypedWriter::create(participant, topic_of<T>(), promise).map([](UntypedWriter writer) {
      return Writer(std::move(writer));
    });
  }

  [[nodiscard]] dds_return_t write(const T& sample) noexcept { return writer_.write(&sample); }
  [[nodiscard]] int matched_readers() const noexcept { return writer_.matched_readers(); }
  [[nodiscard]] RefusedReaders refused_readers() const noexcept { return writer_.refused_readers(); }

 private:
  explicit Writer(UntypedWriter writer) noexcept : writer_(std::move(writer)) {}

  UntypedWriter writer_;
};

}  // namespace perimap::dds
