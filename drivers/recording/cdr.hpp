// IDL types to and from bytes: XCDR2, little-endian, behind the 4-byte encapsulation header of RTPS, by Cyclone DDS's
// own serialiser (DDS-XTypes 1.3 §7.4, DDSI-RTPS 2.5 §10). The same bytes go into recordings.
#pragma once

#include <dds/dds.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

#include "core/error/expected.hpp"
#include "drivers/recording/topic.hpp"

namespace perimap {

// A sample that owns its sequences and strings. Starts as all zeros.
template <class T>
class Sample {
  static_assert(std::is_trivially_copyable_v<T>, "made by idlc");

 public:
  Sample() noexcept = default;
  Sample(Sample&& other) noexcept : value_(std::exchange(other.value_, T{})) {}
  Sample& operator=(Sample&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }
  Sample(const Sample&) = delete;
  Sample& operator=(const Sample&) = delete;
  ~Sample() { dds_sample_free(&value_, topic_type<T>().descriptor, DDS_FREE_CONTENTS); }

  [[nodiscard]] const T& operator*() const noexcept { return value_; }
  [[nodiscard]] const T* operator->() const noexcept { return &value_; }
  // For filling in. What is put in must be freeable by dds_sample_free (allocated by dds_alloc, or `_release` false).
  [[nodiscard]] T& mutable_value() noexcept { return value_; }

 private:
  T value_{};
};

// Larger messages are neither written nor read, so that a damaged length cannot ask for the machine's memory.
inline constexpr std::size_t kMaxSerializedBytes = std::size_t{64} << 20;

// Keeps its buffer from one sample to the next, so that nothing is allocated once it has seen the largest.
class CdrSerializer {
 public:
  CdrSerializer();

  // The bytes are valid until the next call. Fails when a member cannot be represented (an enumerator that does not
  // exist) or the message is too large. Strings must be terminated; an unset `string` member (null) is written as the
  // empty string.
  template <class T>
  [[nodiscard]] Expected<std::span<const std::byte>> serialize(const T& sample) {
    return serialize(&sample, topic_type<T>());
  }

 private:
  [[nodiscard]] Expected<std::span<const std::byte>> serialize(const void* sample, const TopicType& type);

  struct Free {
    void operator()(unsigned char* buffer) const noexcept;
  };
  std::unique_ptr<unsigned char, Free> buffer_;
  std::uint32_t capacity_ = 0;
};

// Fails unless `bytes` is one whole, valid sample of the type in the encapsulation that CdrSerializer writes; bytes of
// any content are safe. Members that an older writer did not know are zero; members unknown here are skipped.
[[nodiscard]] Expected<void> deserialize(std::span<const std::byte> bytes, const TopicType& type, void* zeroed_sample);

template <class T>
[[nodiscard]] Expected<Sample<T>> deserialize(std::span<const std::byte> bytes) {
  Sample<T> sample;
  if (auto read = deserialize(bytes, topic_type<T>(), &sample.mutable_value()); !read) {
    return tl::unexpected(std::move(read.error()));
  }
  return sample;
}

}  // namespace perimap
