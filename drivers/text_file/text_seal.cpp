#include "drivers/text_file/text_seal.hpp"

#include <fmt/format.h>
#include <libdeflate.h>

#include <charconv>
#include <cstddef>
#include <cstdint>

namespace perimap {
namespace {

constexpr std::string_view kMark = "# perimap-crc32 ";
constexpr std::string_view kAdvice = " of what follows; whoever changes it takes this line away";
// Behind a line or two that a format begins with.
constexpr std::size_t kLatest = 64;

std::uint32_t crc32_of(std::string_view text) { return libdeflate_crc32(0, text.data(), text.size()); }

}  // namespace

std::string sealed_text(std::string_view head, std::string_view rest) {
  return fmt::format("{}{}{:08x}{}\n{}", head, kMark, crc32_of(rest), kAdvice, rest);
}

Expected<void> check_seal(std::string_view text) {
  const std::size_t mark = text.find(kMark);
  if (mark == std::string_view::npos || mark > kLatest || (mark > 0 && text[mark - 1] != '\n')) return {};
  const std::string_view told = text.substr(mark + kMark.size(), 8);
  std::uint32_t crc = 0;
  const auto [end, error] = std::from_chars(told.data(), told.data() + told.size(), crc, 16);
  const std::size_t line_end = text.find('\n', mark);
  if (error != std::errc() || end != told.data() + 8 || line_end == std::string_view::npos) {
    return fail("expected 8 hexadecimal digits after 'perimap-crc32'");
  }
  if (crc32_of(text.substr(line_end + 1)) != crc) {
    return fail(
        "it is not as it was written: a part is damaged or missing. Whoever has changed it on purpose takes the line "
        "with 'perimap-crc32' away");
  }
  return {};
}

}  // namespace perimap
