// A file in memory, for writers and readers under test.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "drivers/recording/byte_sink.hpp"
#include "drivers/recording/byte_source.hpp"

namespace perimap::test {

using Bytes = std::vector<std::byte>;

// Writes into `bytes`, which outlives it; fails from `capacity` bytes on, like a full disk.
class MemorySink final : public ByteSink {
 public:
  explicit MemorySink(Bytes& bytes, std::size_t capacity = std::numeric_limits<std::size_t>::max())
      : bytes_(bytes), capacity_(capacity) {}
  Expected<void> write(std::span<const std::byte> bytes) override {
    if (bytes_.size() + bytes.size() > capacity_) return fail("no space left on device");
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Expected<void> close() override { return {}; }

 private:
  Bytes& bytes_;
  std::size_t capacity_;
};

class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(Bytes bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const noexcept override { return bytes_.size(); }
  Expected<void> read_at(std::uint64_t offset, std::span<std::byte> out) override {
    if (offset > bytes_.size() || out.size() > bytes_.size() - offset) return fail("read beyond the end");
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
    return {};
  }

 private:
  Bytes bytes_;
};

[[nodiscard]] inline std::unique_ptr<ByteSource> source_of(std::span<const std::byte> bytes) {
  return std::make_unique<MemorySource>(Bytes(bytes.begin(), bytes.end()));
}

}  // namespace perimap::test
