#include "drivers/text_file/text_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <memory>
#include <system_error>

#include "core/error/one_line.hpp"

namespace perimap {

Expected<std::string> read_text_file(const std::filesystem::path& file, std::size_t largest, std::string_view what) {
  const auto refuse = [&](int error) {
    return fail(on_one_line(fmt::format("{}: expected a readable {}, got: {}", file.string(), what,
                                        std::generic_category().message(error))));
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!stream) return refuse(errno);
  // Piece by piece: what may be large is mostly not, and need not be asked for and cleared.
  std::string text, piece(std::min<std::size_t>(largest + 1, 1U << 16U), '\0');
  errno = 0;
  while (text.size() <= largest) {
    const std::size_t got =
        std::fread(piece.data(), 1, std::min(piece.size(), largest + 1 - text.size()), stream.get());
    text.append(piece, 0, got);
    if (std::ferror(stream.get()) != 0) return refuse(errno);
    if (got == 0) break;
  }
  return text;
}

Expected<void> write_text_file(const std::filesystem::path& file, std::string_view text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  if (!stream.flush()) return fail(file.string() + ": cannot be written");
  return {};
}

}  // namespace perimap
