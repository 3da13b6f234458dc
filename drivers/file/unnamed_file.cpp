#include "drivers/file/unnamed_file.hpp"

#include <sys/mman.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace perimap {

Expected<UnnamedFile> UnnamedFile::create() {
  Descriptor descriptor(::memfd_create("perimap", MFD_CLOEXEC));
  if (!descriptor) return fail("a file in memory cannot be made: " + std::generic_category().message(errno));
  return UnnamedFile(std::move(descriptor));
}

}  // namespace perimap
