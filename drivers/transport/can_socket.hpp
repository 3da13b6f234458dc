// A raw SocketCAN socket: classic frames with the kernel's receive stamps, error frames, and what the kernel dropped.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap {

struct CanFrame {
  std::uint32_t identifier = 0;  // 11 or 29 bits
  bool extended = false;
  bool error = false;  // from the controller, not from the bus; `identifier` is the class (linux/can/error.h)
  std::uint8_t length = 0;
  std::array<std::uint8_t, 8> data{};
  Instant arrival;                   // the kernel's receive stamp
  std::uint32_t dropped_before = 0;  // frames that the socket's buffer could not hold, since it was opened

  bool operator==(const CanFrame&) const = default;
};

class CanSocket {
 public:
  // Takes frames of this identifier, and error frames. Errors: no such interface, interface down, no CAN in this
  // kernel, permission.
  [[nodiscard]] static Expected<CanSocket> open(const std::string& interface_name, std::uint32_t identifier,
                                                bool extended);

  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  // The next frame, none when there is none now. An error when the interface went down or away.
  [[nodiscard]] Expected<std::optional<CanFrame>> receive();
  // False when the kernel's queue is full, or the interface down for now.
  [[nodiscard]] Expected<bool> send(const CanFrame& frame);

 private:
  CanSocket(Descriptor socket, std::string name) : socket_(std::move(socket)), name_(std::move(name)) {}

  Descriptor socket_;
  std::string name_;
  std::uint32_t dropped_ = 0;
};

}  // namespace perimap
