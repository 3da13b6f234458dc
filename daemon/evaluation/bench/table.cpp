#include "daemon/evaluation/bench/table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/pages/html_page.hpp"

namespace perimap::bench {

std::string text_of(const Table& table) {
  if (table.rows.empty()) return "";
  std::vector<std::size_t> widths;
  for (const std::string& cell : table.head) widths.push_back(cell.size());
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string out = table.title + "\n";
  const auto line = [&](const std::vector<std::string>& row) {
    out += fmt::format("{:<{}}", row[0], widths[0]);
    for (std::size_t i = 1; i < row.size(); ++i) out += fmt::format("  {:>{}}", row[i], widths[i]);
    out += '\n';
  };
  line(table.head);
  for (const auto& row : table.rows) line(row);
  if (!table.note.empty()) out += table.note + "\n";
  return out + "\n";
}

std::string html_of(const Table& table) {
  if (table.rows.empty()) return "";
  std::string out = "<h2>" + escaped(table.title) + "</h2>\n<table><tr>";
  for (const std::string& cell : table.head) out += "<th>" + escaped(cell) + "</th>";
  out += "</tr>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (const std::string& cell : row) out += "<td>" + escaped(cell) + "</td>";
    out += "</tr>\n";
  }
  return out + "</table>\n<p>" + escaped(table.note) + "</p>\n";
}

}  // namespace perimap::bench
