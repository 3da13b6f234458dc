// A table for a terminal and for a page.
#pragma once

#include <string>
#include <vector>

namespace perimap::bench {

// The heading and the rows are all of as many cells; the first column names the row.
struct Table {
  std::string title;
  std::string note;
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};

// Both are empty where there are no rows.
[[nodiscard]] std::string text_of(const Table& table);
[[nodiscard]] std::string html_of(const Table& table);

}  // namespace perimap::bench
