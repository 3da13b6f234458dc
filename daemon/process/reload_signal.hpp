// SIGHUP as something to wait for.
#pragma once

#include <utility>

#include "core/error/expected.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap {

// Takes the signal away from its handler, which would end the process, and keeps it in a descriptor. Install it in main
// before any thread starts: threads inherit that the signal is blocked. One that comes before anyone waits is not lost.
class ReloadSignal {
 public:
  [[nodiscard]] static Expected<ReloadSignal> install();

  // True when the signal has come, false when the other descriptor can be read: it is time to end. One thread at a
  // time.
  [[nodiscard]] bool wait(int interrupt_descriptor) noexcept;

 private:
  explicit ReloadSignal(Descriptor descriptor) noexcept : descriptor_(std::move(descriptor)) {}

  Descriptor descriptor_;
};

}  // namespace perimap
