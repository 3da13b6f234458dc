#include "drivers/text_file/text_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "core/error/one_line.hpp"
#include "drivers/file/c_stream.hpp"
#include "drivers/file/output_file.hpp"
#include "drivers/file/regular_file.hpp"

namespace perimap {

Expected<std::string> read_text_file(const std::filesystem::path& file, std::size_t largest, std::string_view what) {
  const auto refuse = [&](std::string_view reason) {
    return fail(on_one_line(fmt::format("{}: expected a readable {}, got: {}", file.string(), what, reason)));
  };
  auto opened = open_regular_file(file);
  if (!opened) return refuse(opened.error());
  const CStream stream = stream_of(*std::move(opened), "rb");
  if (!stream) return refuse(std::generic_category().message(errno));
  // Piece by piece: what may be large is mostly not, and need not be asked for and cleared.
  std::string text, piece(std::min<std::size_t>(largest + 1, 1U << 16U), '\0');
  errno = 0;
  while (text.size() <= largest) {
    const std::size_t got =
        std::fread(piece.data(), 1, std::min(piece.size(), largest + 1 - text.size()), stream.get());
    text.append(piece, 0, got);
    if (std::ferror(stream.get()) != 0) return refuse(std::generic_category().message(errno));
    if (got == 0) break;
  }
  return text;
}

Expected<void> write_text_file(const std::filesystem::path& file, std::string_view text, WholeFile::Readers readers) {
  auto whole = WholeFile::create(file, WholeFile::Name::kPart, readers);
  if (!whole) return tl::unexpected(whole.error());
  const auto refuse = [&](std::string_view reason) {
    return fail(on_one_line(fmt::format("{}: cannot be written: {}", file.string(), reason)));
  };
  auto opened = open_output_file(whole->path());
  if (!opened) return refuse(opened.error());
  CStream stream = stream_of(*std::move(opened), "wb");
  const bool written = stream && std::fwrite(text.data(), 1, text.size(), stream.get()) == text.size();
  if (!written || std::fclose(stream.release()) != 0) return refuse(std::generic_category().message(errno));
  return whole->finish();
}

}  // namespace perimap
