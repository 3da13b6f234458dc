#include "drivers/ecg_file/table_field.hpp"

#include <algorithm>
#include <charconv>

namespace perimap {
namespace {

constexpr std::string_view kSpace = " \t";

std::string_view trimmed(std::string_view field) noexcept {
  field.remove_prefix(std::min(field.find_first_not_of(kSpace), field.size()));
  return field.substr(0, field.find_last_not_of(kSpace) + 1);
}

char lower(char c) noexcept { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }
bool is_letter(char c) noexcept { return lower(c) >= 'a' && lower(c) <= 'z'; }

}  // namespace

namespace {

// Within a number in quotes: commas between thousands, "1,041.2", go; a decimal comma, "0,5", becomes a point.
void append_quoted(std::string& table, std::string_view number) {
  const bool is_number = number.find_first_not_of("0123456789.,+-eE ") == std::string_view::npos;
  bool thousands = is_number;
  for (std::size_t comma = number.find(','); comma != std::string_view::npos; comma = number.find(',', comma + 1)) {
    const std::size_t end = std::min(number.find_first_of(",.", comma + 1), number.size());
    thousands = thousands && end - comma == 4 && comma > 0;
  }
  for (const char c : number) {
    if (c != ',' || !is_number) {
      table += c;
    } else if (!thousands) {
      table += '.';
    }
  }
}

std::string without_commas_in_quotes(std::string_view text) {
  std::string table;
  table.reserve(text.size());
  for (;;) {
    const std::size_t open = text.find('"');
    const std::size_t close = open == std::string_view::npos ? open : text.find_first_of("\"\n", open + 1);
    if (close == std::string_view::npos) break;
    table += text.substr(0, open + 1);
    if (text[close] == '"') {
      append_quoted(table, text.substr(open + 1, close - open - 1));
    } else {
      table += text.substr(open + 1, close - open - 1);  // a quote alone
    }
    table += text[close];
    text.remove_prefix(close + 1);
  }
  table += text;
  return table;
}

}  // namespace

std::string with_commas(std::string_view text) {
  std::string table = without_commas_in_quotes(text);
  text = table;
  std::string_view first;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (line.starts_with('#') || line.find_first_of("0123456789") == std::string_view::npos) continue;
    first = trimmed(line);
    // A heading such as V5 has a digit as well; what begins with a number is none.
    if (to_number(first.substr(0, first.find_first_of(",; \t")))) break;
  }
  if (!first.empty() && first.back() == '\r') first = trimmed(first.substr(0, first.size() - 1));
  const bool semicolons = first.find(';') != std::string_view::npos;
  // A tab beside a comma is but space.
  const std::size_t tab = first.find('\t');
  const std::string_view before_tab = trimmed(first.substr(0, tab));
  const bool tabs = tab != std::string_view::npos && !before_tab.ends_with(',');
  if (semicolons || tabs) {
    const char separator = semicolons ? ';' : '\t';
    for (char& c : table) {
      if (c == ',') {
        c = '.';
      } else if (c == separator) {
        c = ',';
      }
    }
  } else if (first.find(' ') != std::string_view::npos && first.find_first_of(",\"'") == std::string_view::npos) {
    char before = '\n';
    for (char& c : table) {
      const char here = c;
      if (here == ' ' && before != ' ' && before != '\n') c = ',';
      before = here;
    }
    // A space at the end of a line separates nothing.
    for (std::size_t i = 0; i + 1 < table.size(); ++i) {
      std::size_t after = i + 1;
      while (after < table.size() && table[after] == ' ') ++after;
      if (table[i] == ',' && (after == table.size() || table[after] == '\n' || table[after] == '\r')) table[i] = ' ';
    }
  }
  return table;
}

bool is_nothing(std::string_view field) {
  const std::string word = word_of(field);
  return word.empty() || word == "na" || word == "n/a" || word == "null" || word == "none" || word == "-" ||
         word == "?";
}

std::string_view bare(std::string_view field) noexcept {
  field = trimmed(field);
  // A quote alone is none: annotations have such symbols.
  const bool quoted = field.size() >= 2 && field.front() == field.back() && (field[0] == '"' || field[0] == '\'');
  return quoted ? trimmed(field.substr(1, field.size() - 2)) : field;
}

std::optional<double> to_number(std::string_view field) noexcept {
  field = bare(field);
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size()) return std::nullopt;
  return value;
}

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t comma = line.find(',');
    fields.push_back(bare(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

std::string word_of(std::string_view field) {
  field = bare(field);
  if (field.size() > 2 && (field.front() == '[' || field.front() == '(')) field = field.substr(1, field.size() - 2);
  std::string word(field);
  std::transform(word.begin(), word.end(), word.begin(), lower);
  return word;
}

bool is_time_name(std::string_view field) {
  std::string_view name = bare(field);
  for (bool first = true;; first = false) {
    const auto begin = std::find_if(name.begin(), name.end(), is_letter);
    const auto end = std::find_if_not(begin, name.end(), is_letter);
    if (begin == end) return false;
    const std::string word = word_of({&*begin, static_cast<std::size_t>(end - begin)});
    if (word.starts_with("time") || word.ends_with("time")) return true;
    if (first && (word == "t" || word == "seconds")) return true;
    name.remove_prefix(static_cast<std::size_t>(end - name.begin()));
  }
}

}  // namespace perimap
