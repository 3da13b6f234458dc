// Files that nobody else sees, for what takes a file and is to leave none.
#pragma once

#include <string>

#include "core/error/expected.hpp"

namespace perimap {

// A file in memory that no folder has: it is gone with this object, and with the process, however that ends.
class UnnamedFile {
 public:
  [[nodiscard]] static Expected<UnnamedFile> create();

  UnnamedFile(UnnamedFile&& other) noexcept;
  UnnamedFile& operator=(UnnamedFile&&) = delete;
  UnnamedFile(const UnnamedFile&) = delete;
  UnnamedFile& operator=(const UnnamedFile&) = delete;
  ~UnnamedFile();

  // Where this process opens it, to write and to read; for as long as this lives.
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  explicit UnnamedFile(int descriptor) noexcept : descriptor_(descriptor) {}

  int descriptor_;
};

}  // namespace perimap
