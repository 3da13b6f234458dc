#include "drivers/pose_file/number_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>

#include "core/error/one_line.hpp"

namespace perimap {
namespace {

constexpr std::size_t kMostFields = 4096;  // of a line
constexpr std::size_t kShown = 40;         // bytes of a wrong field that a message repeats

std::string_view trimmed(std::string_view field) noexcept {
  constexpr std::string_view kSpace = " \t\r\"";
  field.remove_prefix(std::min(field.find_first_not_of(kSpace), field.size()));
  return field.substr(0, field.find_last_not_of(kSpace) + 1);
}

// The separator of a table by its first line: the first of these that stands in it.
char separator_of(std::string_view line) noexcept {
  for (const char c : {',', ';', '\t'}) {
    if (line.find(c) != std::string_view::npos) return c;
  }
  return ' ';
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  line = trimmed(line);
  while (fields.size() <= kMostFields) {
    const std::size_t end = line.find(separator);
    fields.push_back(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) break;
    line.remove_prefix(end + 1);
    if (separator == ' ') line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  }
  return fields;
}

std::optional<double> number_of(std::string_view field) noexcept {
  if (field.empty() || field == "nan" || field == "NaN" || field == "NAN") {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (field.front() == '+') field.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size()) return std::nullopt;
  return value;
}

}  // namespace

Expected<NumberTable> parse_number_table(std::string_view text, std::string_view name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  NumberTable table;
  std::size_t line_number = 0;
  std::optional<char> separator;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    ++line_number;
    if (line.empty() || line.front() == '#') continue;
    if (!separator) separator = separator_of(line);
    const std::vector<std::string_view> fields = split(line, *separator);
    std::vector<double> row;
    std::string_view wrong;
    for (const std::string_view field : fields) {
      const auto number = number_of(field);
      if (!number && wrong.empty()) wrong = field;
      row.push_back(number.value_or(0.0));
    }
    if (!wrong.empty() && table.rows.empty() && table.heading.empty()) {
      table.heading.assign(fields.begin(), fields.end());
      continue;
    }
    if (!wrong.empty()) {
      return fail(
          on_one_line(fmt::format("{}:{}: expected a number, got '{}'", name, line_number, wrong.substr(0, kShown))));
    }
    const std::size_t expected = table.rows.empty() ? row.size() : table.rows.front().size();
    if (row.size() != expected) {
      return fail(on_one_line(fmt::format("{}:{}: expected {} fields as in the lines before, got {}", name, line_number,
                                          expected, row.size())));
    }
    table.rows.push_back(std::move(row));
    table.lines.push_back(line_number);
  }
  if (table.rows.empty()) return fail(on_one_line(fmt::format("{}: there are no numbers in it", name)));
  return table;
}

}  // namespace perimap
