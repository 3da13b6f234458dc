// The few calls by which a V4L2 device node is used: the seam between what the kernel does and what we make of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

class V4l2Node {
 public:
  enum class Ready : std::uint8_t {
    kNothing,      // the time is over
    kBuffer,       // a buffer may be taken
    kError,        // the node has stopped; taking a buffer says why
    kEvent,        // an event waits
    kInterrupted,  // by the interrupt
  };

  virtual ~V4l2Node() = default;

  // ioctl(2), begun again when a signal cut it short. 0, or the error number.
  [[nodiscard]] virtual int control(unsigned long request, void* argument) = 0;
  // Shared memory of the device, readable and writable. Empty when it is refused.
  [[nodiscard]] virtual std::span<std::byte> map(std::size_t length, std::int64_t offset) = 0;
  virtual void unmap(std::span<std::byte> memory) noexcept = 0;
  [[nodiscard]] virtual Ready wait(Duration longest, const Interrupt& interrupt) = 0;
};

using V4l2Opener = std::function<Expected<std::unique_ptr<V4l2Node>>(const std::string& path)>;

// Errors name the path and what to do: no such device, no permission, in use, no video device.
[[nodiscard]] Expected<std::unique_ptr<V4l2Node>> open_v4l2_node(const std::string& path);

}  // namespace perimap
