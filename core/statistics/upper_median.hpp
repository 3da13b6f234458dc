// The middle of some values.
#pragma once

#include <algorithm>

namespace perimap {

// Of an even number of values the upper of the middle two; reorders. At least one must be there.
template <class Iterator>
[[nodiscard]] auto upper_median(Iterator begin, Iterator end) noexcept {
  const Iterator middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end);
  return *middle;
}

}  // namespace perimap
