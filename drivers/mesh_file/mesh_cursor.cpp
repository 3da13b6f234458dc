#include "drivers/mesh_file/mesh_cursor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/error/one_line.hpp"

namespace perimap {
namespace {

bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f'; }

std::string_view without_plus(std::string_view word) noexcept {
  return word.size() > 1 && word.front() == '+' ? word.substr(1) : word;
}

}  // namespace

std::string quoted(std::string_view word) {
  constexpr std::size_t kMost = 40;
  return word.empty() ? "the file's end"
                      : fmt::format("'{}{}'", word.substr(0, kMost), word.size() > kMost ? "..." : "");
}

std::string_view MeshCursor::word() noexcept {
  while (!at_end() && is_blank(bytes_[position_])) {
    line_ += bytes_[position_] == '\n' ? 1 : 0;
    ++position_;
  }
  const std::size_t begin = position_;
  while (!at_end() && !is_blank(bytes_[position_])) ++position_;
  told_line_ = line_;
  return bytes_.substr(begin, position_ - begin);
}

std::string_view MeshCursor::line() noexcept {
  const std::size_t end = std::min(bytes_.find('\n', position_), bytes_.size());
  std::string_view text = bytes_.substr(position_, end - position_);
  told_line_ = line_;
  if (end < bytes_.size()) ++line_;
  position_ = std::min(end + 1, bytes_.size());
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

Expected<double> MeshCursor::real_of(std::string_view word, std::string_view what) const {
  const std::string_view digits = without_plus(word);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(value)) {
    return wrong_line(fmt::format("expected {}, a number, got: {}", what, quoted(word)));
  }
  return value;
}

Expected<std::int64_t> MeshCursor::integer_of(std::string_view word, std::string_view what) const {
  const std::string_view digits = without_plus(word);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size()) {
    return wrong_line(fmt::format("expected {}, a whole number, got: {}", what, quoted(word)));
  }
  return value;
}

Expected<double> MeshCursor::real(std::string_view what) { return real_of(word(), what); }
Expected<std::int64_t> MeshCursor::integer(std::string_view what) { return integer_of(word(), what); }

bool MeshCursor::skip(std::size_t bytes) noexcept {
  if (left() < bytes) return false;
  position_ += bytes;
  return true;
}

tl::unexpected<Error> MeshCursor::wrong_line(const std::string& what) const {
  return fail(on_one_line(fmt::format("{}:{}: {}", name_, told_line_, what)));
}
tl::unexpected<Error> MeshCursor::wrong_byte(const std::string& what) const {
  return fail(on_one_line(fmt::format("{}: byte {}: {}", name_, position_, what)));
}
tl::unexpected<Error> MeshCursor::wrong_file(const std::string& what) const {
  return fail(on_one_line(fmt::format("{}: {}", name_, what)));
}

}  // namespace perimap
