#include "drivers/toml/toml_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/error/one_line.hpp"

namespace perimap {
namespace {

constexpr int kMostDots = 200;             // on one line: a hundred numbers and more
constexpr std::size_t kLongestQuote = 60;  // bytes of a wrong value that a message repeats

std::string quote(std::string_view text) {
  std::size_t end = std::min(text.size(), kLongestQuote);
  while (end < text.size() && end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) {
    --end;  // not in the middle of a UTF-8 sequence
  }
  return fmt::format("\"{}{}\"", text.substr(0, end), end < text.size() ? "..." : "");
}

// The first character that toml++ 3.3 must not see, if there is one: it has undefined behaviour on some letters outside
// of strings and comments (its is_non_ascii_horizontal_whitespace, U+3001 for one), where TOML allows ASCII alone. On a
// malformed line it may not take for a string what looks like one ("a = 1x='..."), so letters beyond ASCII may stand
// only in comments and where nothing but strings follows the line's first "=".
// Strings over several lines, which no key takes, are refused too, so that a string always ends with its line.
// So are keys of very many parts: its tables nest as deep as a key is long, and it walks them by recursion.
std::optional<std::string> refused_character(std::string_view text) {
  int line = 1;
  int column = 0;  // in characters, as toml++ counts
  char quote = 0;  // of the string we are in
  bool comment = false;
  bool escaped = false;
  int dots = 0;  // of this line, outside of strings and comments
  enum class Place : std::uint8_t { kBeforeEquals, kStringsAfterEquals, kOtherAfterEquals };
  Place place = Place::kBeforeEquals;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if ((static_cast<unsigned char>(c) & 0xC0) != 0x80) {
      ++column;
    }
    if (c == '\n') {
      ++line;
      column = 0;
      quote = 0;
      comment = false;
      escaped = false;
      dots = 0;
      place = Place::kBeforeEquals;
    } else if (comment) {
      continue;
    } else if (quote == 0 && c == '.' && ++dots > kMostDots) {
      return fmt::format("{}:{}: expected TOML, got: a line of more than {} dots", line, column, kMostDots);
    } else if (static_cast<unsigned char>(c) >= 0x80 && (quote == 0 || place != Place::kStringsAfterEquals)) {
      return fmt::format("{}:{}: expected TOML, got: a letter beyond ASCII outside of strings and comments", line,
                         column);
    } else if (quote != 0) {
      const bool closes = c == quote && !escaped;
      escaped = c == '\\' && quote == '"' && !escaped;
      quote = closes ? '\0' : quote;
    } else if (text.substr(i, 3) == R"(""")" || text.substr(i, 3) == "'''") {
      return fmt::format("{}:{}: expected a string on one line, got: one over several lines", line, column);
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else {
      comment = c == '#';
      constexpr std::string_view kBetweenStrings = " \t\r,[]";
      if (place == Place::kBeforeEquals) {
        place = c == '=' ? Place::kStringsAfterEquals : place;
      } else if (!comment && kBetweenStrings.find(c) == std::string_view::npos) {
        place = Place::kOtherAfterEquals;
      }
    }
  }
  return std::nullopt;
}

}  // namespace

std::string describe(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::boolean:
      return node.as_boolean()->get() ? "true" : "false";
    case toml::node_type::integer:
      return fmt::format("{}", node.as_integer()->get());
    case toml::node_type::floating_point:
      return fmt::format("{}", node.as_floating_point()->get());
    case toml::node_type::string:
      return quote(node.as_string()->get());
    case toml::node_type::array: {
      std::string elements;
      for (const toml::node& element : *node.as_array()) {
        if (elements.size() > kLongestQuote) {
          elements += ", ...";
          break;
        }
        elements +=
            fmt::format("{}{}", elements.empty() ? "" : ", ", element.is_array() ? "an array" : describe(element));
      }
      return fmt::format("[{}]", elements);
    }
    case toml::node_type::table:
      return "a table";
    default:
      return "a date or time";
  }
}

Expected<toml::table> parse_toml(std::string_view text, const std::filesystem::path& file) {
  if (text.size() > kLargestToml) {
    return fail(on_one_line(
        fmt::format("{}:1:1: expected at most {} bytes of TOML, got {}", file.string(), kLargestToml, text.size())));
  }
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (const std::optional<std::string> refused = refused_character(text)) {
    return fail(on_one_line(fmt::format("{}:{}", file.string(), *refused)));
  }
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    const toml::source_position where = error.source().begin;
    return fail(on_one_line(
        fmt::format("{}:{}:{}: expected TOML, got: {}", file.string(), where.line, where.column, error.description())));
  }
}

}  // namespace perimap
