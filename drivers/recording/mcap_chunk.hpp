// The records of a chunk, unpacked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/error/expected.hpp"

struct ZSTD_DCtx_s;

namespace perimap::mcap {

class ChunkUnpacker {
 public:
  ChunkUnpacker();

  // `content` of the chunk record at byte `offset` of the file. Sizes are held against each other and against the limit
  // before anything is allocated, and the CRC, where there is one, is checked.
  Expected<void> unpack(std::span<const std::byte> content, std::uint64_t offset, std::vector<std::byte>& unpacked);

 private:
  struct FreeContext {
    void operator()(ZSTD_DCtx_s* context) const noexcept;
  };
  std::unique_ptr<ZSTD_DCtx_s, FreeContext> context_;
};

}  // namespace perimap::mcap
