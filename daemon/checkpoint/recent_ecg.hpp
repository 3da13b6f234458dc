// The ECG that was heard last: from it detector, classes and the autoregression over 60 intervals are learnt again.
#pragma once

#include <chrono>
#include <deque>

#include "core/sensors/ecg_block.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// A minute of what was heard, however long ago: after crashes soon after one another the last minute of the clock holds
// little but gaps, which teach no rhythm.
class RecentEcg {
 public:
  static constexpr Duration kKept = std::chrono::seconds(60);

  // One without samples says nothing that the gap to the next one does not.
  void add(const EcgBlock& block) {
    if (block.count == 0) return;
    blocks_.push_back(block);
    heard_ += duration_of(block);
    while (heard_ - duration_of(blocks_.front()) >= kKept) {
      heard_ -= duration_of(blocks_.front());
      blocks_.pop_front();
    }
  }
  void clear() noexcept {
    blocks_.clear();
    heard_ = Duration(0);
  }
  [[nodiscard]] const std::deque<EcgBlock>& blocks() const noexcept { return blocks_; }

 private:
  static Duration duration_of(const EcgBlock& block) noexcept { return block.count * block.sample_period; }

  std::deque<EcgBlock> blocks_;
  Duration heard_{0};  // by all of them
};

}  // namespace perimap
