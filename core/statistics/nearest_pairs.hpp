// Which instants of two sequences are the same event.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace perimap {

// For each of `reference_s` the index of the one of `found_s` that is it, or -1: no farther than `within_s`, at most
// one each way, the nearest pairs first. Both in order of time.
[[nodiscard]] inline std::vector<int> nearest_pairs(const std::vector<double>& reference_s,
                                                    const std::vector<double>& found_s, double within_s) {
  struct Pair {
    double apart_s;
    std::size_t reference;
    std::size_t found;
  };
  std::vector<Pair> pairs;
  std::size_t from = 0;
  for (std::size_t i = 0; i < reference_s.size(); ++i) {
    while (from < found_s.size() && found_s[from] < reference_s[i] - within_s) ++from;
    for (std::size_t j = from; j < found_s.size() && found_s[j] - reference_s[i] <= within_s; ++j) {
      const double apart_s = std::abs(found_s[j] - reference_s[i]);
      if (apart_s <= within_s) pairs.push_back({apart_s, i, j});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.apart_s < b.apart_s; });
  std::vector<int> matched(reference_s.size(), -1);
  std::vector<bool> used(found_s.size(), false);
  for (const Pair& pair : pairs) {
    if (matched[pair.reference] >= 0 || used[pair.found]) continue;
    matched[pair.reference] = static_cast<int>(pair.found);
    used[pair.found] = true;
  }
  return matched;
}

}  // namespace perimap
