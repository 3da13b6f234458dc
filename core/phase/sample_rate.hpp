// The sample period of a signal, from the stamps of its samples.
#pragma once

#include <array>

#include "core/phase/recent_values.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// The median of means over sixteen steps each, so that neither stamps rounded to a millisecond nor samples that are
// missing now and then tell in it, and a rate that has changed is known after five times sixteen samples.
class SampleRate {
 public:
  // The next sample has none before it.
  void interrupt() noexcept { step_count_ = -1; }
  void push(Instant t) noexcept;

  // Zero until sixteen steps without interruption are known.
  [[nodiscard]] Duration period() const noexcept;
  // `used` is not the rate, surely.
  [[nodiscard]] bool contradicts(Duration used) const noexcept;

 private:
  static constexpr int kBlock = 16;
  static constexpr int kBlocks = 9;

  std::array<double, kBlock> steps_s_{};
  int step_count_ = -1;
  Instant newest_;
  RecentValues<kBlocks> blocks_s_;
};

}  // namespace perimap
