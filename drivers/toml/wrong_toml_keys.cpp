#include "drivers/toml/wrong_toml_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error/one_line.hpp"

namespace perimap {

void WrongTomlKeys::add(toml::source_position where, std::string_view key, std::string_view expected,
                        std::string_view got) {
  wrong_.push_back({where, on_one_line(fmt::format("{}:{}:{}: key '{}': expected {}, got {}", file_, where.line,
                                                   where.column, key, expected, got))});
}

std::vector<Error> WrongTomlKeys::each() const {
  std::vector<Error> all;
  for (const Wrong& wrong : wrong_) all.push_back({wrong.message});
  return all;
}

Error WrongTomlKeys::told() const {
  constexpr std::size_t kMost = 20;  // what is wrong more often is another kind of file
  std::vector<Wrong> sorted = wrong_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Wrong& a, const Wrong& b) {
    return std::pair(a.where.line, a.where.column) < std::pair(b.where.line, b.where.column);
  });
  std::string all;
  for (std::size_t i = 0; i < std::min(kMost, sorted.size()); ++i) {
    all += fmt::format("{}{}", i > 0 ? "\n" : "", sorted[i].message);
  }
  if (sorted.size() > kMost) {
    all += fmt::format("\n{}: and {} more wrong keys", on_one_line(file_), sorted.size() - kMost);
  }
  return {all};
}

}  // namespace perimap
