#include "drivers/transport/byte_stream.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace perimap {

Expected<std::size_t> read_available(int descriptor, std::span<std::byte> buffer, const char* name) {
  if (buffer.empty()) return std::size_t{0};
  for (;;) {
    const ssize_t got = ::read(descriptor, buffer.data(), buffer.size());
    if (got > 0) return static_cast<std::size_t>(got);
    if (got == 0) return fail(fmt::format("{}: the device has gone: unplugged, or it closed the connection", name));
    if (errno == EINTR) continue;
    if (errno == EAGAIN) return std::size_t{0};
    if (errno == EIO || errno == ENXIO || errno == ENODEV)
      return fail(fmt::format("{}: the device was unplugged", name));
    return fail(fmt::format("{}: cannot read: {}", name, std::generic_category().message(errno)));
  }
}

Expected<std::size_t> write_available(int descriptor, std::span<const std::byte> bytes, const char* name) {
  if (bytes.empty()) return std::size_t{0};
  for (;;) {
    const ssize_t put = ::write(descriptor, bytes.data(), bytes.size());
    if (put >= 0) return static_cast<std::size_t>(put);
    if (errno == EINTR) continue;
    if (errno == EAGAIN) return std::size_t{0};
    return fail(fmt::format("{}: cannot write: {}", name, std::generic_category().message(errno)));
  }
}

}  // namespace perimap
