#include "drivers/file/regular_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <system_error>

namespace perimap {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

// Empty for a regular file.
std::string other_kind(mode_t mode) {
  if (S_ISREG(mode)) return "";
  if (S_ISDIR(mode)) return reason(EISDIR);
  if (S_ISFIFO(mode)) return "a pipe, and no file";
  if (S_ISSOCK(mode)) return "a socket, and no file";
  return "a device, and no file";
}

}  // namespace

tl::expected<Descriptor, std::string> open_regular_file(const std::filesystem::path& file) {
  // Without O_NONBLOCK this call would be what waits; on a regular file the flag does nothing.
  Descriptor descriptor(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  // A socket cannot be opened at all.
  if (!descriptor) return tl::unexpected(errno == ENXIO ? other_kind(S_IFSOCK) : reason(errno));
  struct stat status {};
  std::string wrong = ::fstat(descriptor.get(), &status) != 0 ? reason(errno) : other_kind(status.st_mode);
  if (wrong.empty()) return descriptor;
  return tl::unexpected(std::move(wrong));
}

}  // namespace perimap
