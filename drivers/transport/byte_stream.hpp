// An open two-way stream of bytes to a device: a serial line, a TCP connection. Never blocks.
#pragma once

#include <cstddef>
#include <span>

#include "core/error/expected.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap {

class ByteStream {
 public:
  virtual ~ByteStream() = default;

  // The bytes that are there now, 0 when there are none. An error says that the other side has gone, and how.
  [[nodiscard]] virtual Expected<std::size_t> read(std::span<std::byte> buffer) = 0;
  // What the kernel takes now; 0 when its buffer is full.
  [[nodiscard]] virtual Expected<std::size_t> write(std::span<const std::byte> bytes) = 0;

  // Readable or hung up: there is something to read(). Ready for output: write() takes some.
  [[nodiscard]] virtual int descriptor() const noexcept = 0;

  // Of a serial line. A stream without a line has nothing to set, and says that it is well.
  [[nodiscard]] virtual Expected<void> set_line_rate(int /*baud*/) { return {}; }
  [[nodiscard]] virtual Expected<void> send_break() { return {}; }
  // Time that one byte takes on the wire, ns; 0 when it does not matter.
  [[nodiscard]] virtual double byte_time_ns() const noexcept { return 0.0; }
};

// read() and write() of any descriptor that is in non-blocking mode. `name` stands in errors.
[[nodiscard]] Expected<std::size_t> read_available(int descriptor, std::span<std::byte> buffer, const char* name);
[[nodiscard]] Expected<std::size_t> write_available(int descriptor, std::span<const std::byte> bytes, const char* name);

}  // namespace perimap
