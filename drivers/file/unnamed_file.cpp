#include "drivers/file/unnamed_file.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace perimap {

Expected<UnnamedFile> UnnamedFile::create() {
  const int descriptor = ::memfd_create("perimap", MFD_CLOEXEC);
  if (descriptor < 0) return fail("a file in memory cannot be made: " + std::generic_category().message(errno));
  return UnnamedFile(descriptor);
}

UnnamedFile::UnnamedFile(UnnamedFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

UnnamedFile::~UnnamedFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace perimap
