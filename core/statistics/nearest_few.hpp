// The nearest of many, as few as are wanted.
#pragma once

#include <array>
#include <cstddef>

namespace perimap {

// In the order of their distances; of equal ones those that came first. Takes nothing from the heap.
template <class Value, std::size_t kMost>
class NearestFew {
 public:
  struct Near {
    double distance_squared = 0;
    Value value{};
  };

  // Whether one so far away is among them; the value need not be made else.
  [[nodiscard]] bool takes(double distance_squared) const noexcept {
    return count_ < kMost || distance_squared < nearest_[kMost - 1].distance_squared;
  }
  // One that it takes.
  void add(double distance_squared, const Value& value) noexcept {
    std::size_t place = count_ < kMost ? count_++ : kMost - 1;
    for (; place > 0 && nearest_[place - 1].distance_squared > distance_squared; --place) {
      nearest_[place] = nearest_[place - 1];
    }
    nearest_[place] = {distance_squared, value};
  }

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] const Near& operator[](std::size_t i) const noexcept { return nearest_[i]; }
  [[nodiscard]] const Near* begin() const noexcept { return nearest_.data(); }
  [[nodiscard]] const Near* end() const noexcept { return nearest_.data() + count_; }

 private:
  std::array<Near, kMost> nearest_{};
  std::size_t count_ = 0;
};

}  // namespace perimap
