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
