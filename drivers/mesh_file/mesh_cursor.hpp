// Where the reading of a mesh file is: words of text, and raw numbers, bounds checked.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "core/error/expected.hpp"

namespace perimap {

class MeshCursor {
 public:
  // Both are borrowed. `name` stands in errors.
  MeshCursor(std::string_view name, std::string_view bytes) noexcept : name_(name), bytes_(bytes) {}

  [[nodiscard]] bool at_end() const noexcept { return position_ >= bytes_.size(); }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - position_; }

  // The next word, wherever its line is; empty at the end.
  [[nodiscard]] std::string_view word() noexcept;
  // The rest of the line, without its end and without blanks around it.
  [[nodiscard]] std::string_view line() noexcept;

  // Words as numbers; `what` names them in errors. Numbers are finite.
  [[nodiscard]] Expected<double> real(std::string_view what);
  [[nodiscard]] Expected<std::int64_t> integer(std::string_view what);
  [[nodiscard]] Expected<double> real_of(std::string_view word, std::string_view what) const;
  [[nodiscard]] Expected<std::int64_t> integer_of(std::string_view word, std::string_view what) const;

  // A raw number; none where the file ends before it does.
  template <class T>
  [[nodiscard]] std::optional<T> raw(bool big_endian) noexcept {
    static_assert(std::is_arithmetic_v<T>);
    if (left() < sizeof(T)) return std::nullopt;
    char buffer[sizeof(T)];
    std::memcpy(buffer, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    if (big_endian != (std::endian::native == std::endian::big)) {
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(buffer[i], buffer[sizeof(T) - 1 - i]);
    }
    T value;
    std::memcpy(&value, buffer, sizeof(T));
    return value;
  }
  [[nodiscard]] bool skip(std::size_t bytes) noexcept;

  // "NAME:LINE: what", of the word or line read last.
  [[nodiscard]] tl::unexpected<Error> wrong_line(const std::string& what) const;
  // "NAME: byte N: what".
  [[nodiscard]] tl::unexpected<Error> wrong_byte(const std::string& what) const;
  [[nodiscard]] tl::unexpected<Error> wrong_file(const std::string& what) const;

 private:
  std::string_view name_;
  std::string_view bytes_;
  std::size_t position_ = 0;
  std::size_t line_ = 1;       // that position_ is in
  std::size_t told_line_ = 1;  // of the word or line read last
};

// As it is quoted in an error: not all of it where it is long.
[[nodiscard]] std::string quoted(std::string_view word);

}  // namespace perimap
