// SIGINT and SIGTERM as something to wait for.
#pragma once

#include <utility>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap {

// Takes the two signals away from their handlers and keeps them in a descriptor, so that no code runs in a signal
// handler. Install it in main before any thread starts: threads inherit that the signals are blocked.
class StopSignal {
 public:
  [[nodiscard]] static Expected<StopSignal> install();

  // Whether a signal has come. Once true, it stays so.
  [[nodiscard]] bool requested() noexcept { return wait_for(Duration(0)); }

  // Waits for a signal, at most so long (monotonic time); the same answer. One thread at a time.
  bool wait_for(Duration longest) noexcept;

  // Readable when a signal has come and neither of the calls above has taken it: for a poll loop of one's own.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_.get(); }

 private:
  explicit StopSignal(Descriptor descriptor) noexcept : descriptor_(std::move(descriptor)) {}

  Descriptor descriptor_;
  bool requested_ = false;
};

}  // namespace perimap
