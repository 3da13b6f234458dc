// What a misspelt name was meant to be.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace perimap {

// The fewest letters to put in, leave out, exchange or swap with their neighbours, no place twice, that make one text
// of the other; case does not count. Optimal string alignment: F. J. Damerau (1964), Communications of the ACM 7(3).
[[nodiscard]] inline std::size_t letters_apart(std::string_view a, std::string_view b) {
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  };
  // Rows i - 2, i - 1 and i of the table whose entry (i, j) is for the first i letters of a and the first j of b.
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(last);
    last.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t exchanged = last[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, exchanged});
      const bool swapped = i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

// The one name that begins so, case apart; empty when that is none or several, or when fewer than three letters are
// given.
template <class Names>
[[nodiscard]] std::string only_name_that_begins(std::string_view start, const Names& names) {
  std::string found;
  if (start.size() < 3) return found;
  for (const std::string_view name : names) {
    if (name.size() < start.size() || letters_apart(start, name.substr(0, start.size())) != 0) continue;
    if (!found.empty()) return {};
    found = name;
  }
  return found;
}

// The one of `names` that is nearest to `misspelt`, the first of several; where none is so near that it could be meant
// (a third of its letters may differ), the only one that begins so; empty without one.
template <class Names>
[[nodiscard]] std::string nearest_name(std::string_view misspelt, const Names& names) {
  constexpr std::size_t kLongest = 64;  // what is longer is no slip of a finger, and would take long
  std::string nearest;
  if (misspelt.empty() || misspelt.size() > kLongest) return nearest;
  std::size_t least = std::max<std::size_t>(1, misspelt.size() / 3) + 1;
  for (const std::string_view name : names) {
    if (name.size() > kLongest) continue;
    const std::size_t apart = letters_apart(misspelt, name);
    if (apart >= least) continue;
    least = apart;
    nearest = name;
  }
  return nearest.empty() ? only_name_that_begins(misspelt, names) : nearest;
}

// For the end of a message: "; did you mean 'simulate'?", or nothing.
template <class Names>
[[nodiscard]] std::string did_you_mean(std::string_view misspelt, const Names& names) {
  const std::string name = nearest_name(misspelt, names);
  return name.empty() ? name : "; did you mean '" + name + "'?";
}

}  // namespace perimap
