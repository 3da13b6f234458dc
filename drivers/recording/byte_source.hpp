// Where a reader's bytes come from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/error/expected.hpp"

namespace perimap {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const noexcept = 0;
  // Fills all of `bytes` from `offset` on, or fails.
  [[nodiscard]] virtual Expected<void> read_at(std::uint64_t offset, std::span<std::byte> bytes) = 0;
};

// Errors of opening name the path, errors of reading the byte. The size is the one at this moment: what a writer adds
// later is not seen.
[[nodiscard]] Expected<std::unique_ptr<ByteSource>> open_file(const std::string& path);

}  // namespace perimap
