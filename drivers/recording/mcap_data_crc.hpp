// The CRC over a recording's data section.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/recording/byte_source.hpp"
#include "drivers/recording/crc32.hpp"

namespace perimap::mcap {

// Taken in as the segments are read in their order. Once one is skipped or damaged there
// is none.
class DataSectionCrc {
 public:
  void restart() noexcept { *this = DataSectionCrc(); }
  void give_up() noexcept { valid_ = false; }
  [[nodiscard]] bool valid() const noexcept { return valid_; }
  [[nodiscard]] std::uint32_t value() const noexcept { return crc_; }

  // Takes in the bytes between the last segment and this one, then `record`.
  Expected<void> feed(ByteSource& source, std::uint64_t offset, std::span<const std::byte> record) {
    constexpr std::uint64_t kBlockBytes = std::uint64_t{256} << 10;
    while (end_ < offset) {
      gap_.resize(static_cast<std::size_t>(std::min(offset - end_, kBlockBytes)));
      if (auto read = source.read_at(end_, gap_); !read) return read;
      crc_ = crc32_update(crc_, gap_);
      end_ += gap_.size();
    }
    crc_ = crc32_update(crc_, record);
    end_ += record.size();
    return {};
  }

 private:
  std::vector<std::byte> gap_;
  std::uint32_t crc_ = 0;  // of the file's first end_ bytes
  std::uint64_t end_ = 0;
  bool valid_ = true;
};

}  // namespace perimap::mcap
