// A log that one thread fills without allocating, read when that thread has ended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace perimap {

// Entries of one thread, in a room that is all there from the beginning: adding one allocates nothing, locks nothing
// and touches no new memory. What finds no room is counted.
template <class Entry>
class alignas(64) FixedLog {
 public:
  explicit FixedLog(std::size_t most) : entries_(most) {}

  // The writing thread.
  void add(const Entry& entry) noexcept {
    if (count_ == entries_.size()) {
      ++left_out_;
      return;
    }
    entries_[count_++] = entry;
  }

  // When the writing thread has ended and was joined, which is what makes its entries visible.
  [[nodiscard]] std::span<const Entry> entries() const noexcept { return std::span(entries_).first(count_); }
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  std::vector<Entry> entries_;
  std::size_t count_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace perimap
