// What is wrong with the keys of a file, gathered while it is read.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/toml/toml.hpp"

namespace perimap {

class WrongTomlKeys {
 public:
  explicit WrongTomlKeys(std::string file) : file_(std::move(file)) {}

  void add(toml::source_position where, std::string_view key, std::string_view expected, std::string_view got);
  [[nodiscard]] bool empty() const { return wrong_.empty(); }

  // A line each, `FILE:LINE:COL: key 'a.b': expected ..., got ...`, in the order in which they were added.
  [[nodiscard]] std::vector<Error> each() const;
  // The same as one error, as they stand in the file; of many the first twenty, and how many more there are.
  [[nodiscard]] Error told() const;

 private:
  struct Wrong {
    toml::source_position where;
    std::string message;
  };

  std::string file_;
  std::vector<Wrong> wrong_;
};

}  // namespace perimap
