#include "daemon/evaluation/watch/duration_counts.hpp"

namespace perimap {

void DurationCounts::add(Duration duration) {
  ++counts_[std::chrono::round<std::chrono::microseconds>(duration)];
  ++count_;
}

DurationSpread DurationCounts::spread() const {
  DurationSpread spread;
  spread.count = count_;
  if (count_ == 0) {
    return spread;
  }
  const std::uint64_t rank_50 = (count_ * 50 + 99) / 100;
  const std::uint64_t rank_99 = (count_ * 99 + 99) / 100;
  std::uint64_t rank = 0;
  for (const auto& [duration, count] : counts_) {
    if (rank < rank_50 && rank + count >= rank_50) {
      spread.p50 = duration;
    }
    if (rank < rank_99 && rank + count >= rank_99) {
      spread.p99 = duration;
    }
    rank += count;
  }
  spread.max = counts_.rbegin()->first;
  return spread;
}

}  // namespace perimap
