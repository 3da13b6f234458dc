// Whether a sensor still senses: what it measures has noise, so a reading that is the one before bit for bit is that
// one given again, as trackers do that have lost their tool, and grabbers that have lost their signal.
#pragma once

#include <chrono>

#include "core/time/instant.hpp"

namespace perimap {

class Repeats {
 public:
  // Each reading, and when it was taken, or came.
  void add(bool same_as_before, Instant t) noexcept {
    if (!same_as_before) fresh_ = t;
    last_ = t;
  }

  // It has been the same for too long to be chance, or a sensor that is asked more often than it measures.
  [[nodiscard]] bool long_enough() const noexcept { return last_ - fresh_ >= kLongEnough; }
  // When the reading came that has been repeated since.
  [[nodiscard]] Instant since() const noexcept { return fresh_; }

 private:
  static constexpr Duration kLongEnough = std::chrono::milliseconds(500);

  Instant fresh_;
  Instant last_;
};

}  // namespace perimap
