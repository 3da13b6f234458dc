// Files that nobody else sees, for what takes a file and is to leave none.
#pragma once

#include <string>
#include <utility>

#include "core/error/expected.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap {

// A file in memory that no folder has: it is gone with this object, and with the process, however that ends.
class UnnamedFile {
 public:
  [[nodiscard]] static Expected<UnnamedFile> create();

  // Where this process opens it, to write and to read; for as long as this lives.
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_.get()); }

 private:
  explicit UnnamedFile(Descriptor descriptor) noexcept : descriptor_(std::move(descriptor)) {}

  Descriptor descriptor_;
};

}  // namespace perimap
