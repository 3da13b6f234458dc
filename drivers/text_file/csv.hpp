// Reading of comma-separated tables.
#pragma once

#include <charconv>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "core/error/expected.hpp"
#include "core/error/one_line.hpp"

namespace perimap {

// Walks the lines of a table and the fields of each line; knows where it is, for errors: "NAME:LINE:COLUMN: what".
class CsvCursor {
 public:
  CsvCursor(std::string name, std::string_view text) : name_(std::move(name)), rest_(text) {
    // What spreadsheets put before UTF-8.
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
  }

  // Moves to the next line that is not empty; false at the end.
  [[nodiscard]] bool next_line() noexcept {
    while (!rest_.empty()) {
      const std::size_t end = rest_.find('\n');
      line_ = rest_.substr(0, end);
      rest_ = end == std::string_view::npos ? std::string_view{} : rest_.substr(end + 1);
      ++line_number_;
      line_begin_ = line_.data();
      field_begin_ = line_begin_;
      if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
      if (!line_.empty()) return true;
    }
    return false;
  }

  // The next field of the line; empty when there are no more.
  [[nodiscard]] std::string_view field() noexcept {
    const std::size_t end = line_.find(',');
    if (line_.data() != nullptr) field_begin_ = line_.data();
    const std::string_view value = line_.substr(0, end);
    line_ = end == std::string_view::npos ? std::string_view{} : line_.substr(end + 1);
    return value;
  }

  // What is left of the line.
  [[nodiscard]] std::string_view rest_of_line() const noexcept { return line_; }
  [[nodiscard]] std::size_t line_number() const noexcept { return line_number_; }

  template <class Number>
  [[nodiscard]] Expected<Number> number() {
    const std::string_view value = field();
    Number result{};
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), result);
    if (error != std::errc{} || end != value.data() + value.size()) return wrong("expected a number", value);
    return result;
  }

  [[nodiscard]] tl::unexpected<Error> wrong(std::string_view what, std::string_view value = {}) const {
    std::string message = name_ + ":" + std::to_string(line_number_) + ":" +
                          std::to_string(field_begin_ - line_begin_ + 1) + ": " + std::string(what);
    if (!value.empty()) message += ", found '" + std::string(value.substr(0, kShown)) + "'";
    return fail(on_one_line(std::move(message)));
  }

 private:
  static constexpr std::size_t kShown = 40;  // of a wrong value

  std::string name_;
  std::string_view rest_;
  std::string_view line_;
  const char* line_begin_ = nullptr;  // for messages
  const char* field_begin_ = nullptr;
  std::size_t line_number_ = 0;
};

}  // namespace perimap
