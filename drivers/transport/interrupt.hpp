// Ends another thread's wait for a device.
#pragma once

#include "drivers/transport/descriptor.hpp"

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

}  // namespace perimap
