// Ends another thread's wait for a device.
#pragma once

#include "core/time/instant.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap {

// request() belongs to any thread; once requested it stays so. Waiters add descriptor() to their poll().
class Interrupt {
 public:
  Interrupt();

  void request() noexcept;
  [[nodiscard]] bool requested() const noexcept;
  [[nodiscard]] int descriptor() const noexcept { return event_.get(); }

 private:
  Descriptor event_;
};

// Sleeps; false when interrupted.
bool wait_unless_interrupted(Duration longest, const Interrupt& interrupt);

}  // namespace perimap
