// The last N values of something, and their median.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

#include "core/statistics/upper_median.hpp"

namespace perimap {

template <int N>
class RecentValues {
 public:
  void push(double value) noexcept {
    values_[static_cast<std::size_t>(next_)] = value;
    next_ = (next_ + 1) % N;
    count_ = std::min(count_ + 1, N);
  }
  void clear() noexcept {
    next_ = 0;
    count_ = 0;
  }
  [[nodiscard]] int count() const noexcept { return count_; }
  // Of an even number of values the upper of the middle two. At least one must be held.
  [[nodiscard]] double median() const noexcept {
    auto sorted = values_;
    return upper_median(sorted.begin(), sorted.begin() + count_);
  }
  // At least one must be held.
  [[nodiscard]] double mean() const noexcept {
    return std::accumulate(values_.begin(), values_.begin() + count_, 0.0) / count_;
  }
  // At least one must be held.
  [[nodiscard]] double newest() const noexcept { return back(1); }
  // Of the newest so many, or all there are. At least one must be held.
  [[nodiscard]] double largest_of_last(int count) const noexcept {
    double largest = newest();
    for (int i = 2; i <= std::min(count, count_); ++i) largest = std::max(largest, back(i));
    return largest;
  }
  [[nodiscard]] double smallest_of_last(int count) const noexcept {
    double smallest = newest();
    for (int i = 2; i <= std::min(count, count_); ++i) smallest = std::min(smallest, back(i));
    return smallest;
  }
  // Of the newest two, or the only one.
  [[nodiscard]] double mean_of_last_two() const noexcept {
    const double last = newest();
    return count_ < 2 ? last : 0.5 * (last + back(2));
  }

 private:
  // The newest is 1 back.
  [[nodiscard]] double back(int i) const noexcept { return values_[static_cast<std::size_t>((next_ + 2 * N - i) % N)]; }

  std::array<double, N> values_{};
  int next_ = 0;
  int count_ = 0;
};

}  // namespace perimap
