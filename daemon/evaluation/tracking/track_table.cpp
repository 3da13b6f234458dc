#include "daemon/evaluation/tracking/track_table.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "drivers/file/output_file.hpp"

namespace perimap {

Expected<TrackTable> TrackTable::create(const std::string& path) {
  auto whole = WholeFile::create(path);
  if (!whole) return tl::unexpected(whole.error());
  auto opened = open_output_file(whole->path());
  if (!opened) return fail(path + ": cannot be written: " + opened.error());
  CStream file = stream_of(*std::move(opened), "w");
  if (file == nullptr) return fail(path + ": cannot be written: " + std::generic_category().message(errno));
  fmt::print(file.get(), "frame,id,x,y,state\n");
  return TrackTable(path, std::move(*whole), std::move(file));
}

void TrackTable::write(std::span<const TrackRow> rows) {
  std::string lines;
  for (const TrackRow& row : rows) {
    lines += fmt::format("{},{},{:.3f},{:.3f},{}\n", row.frame, row.id, row.px.x(), row.px.y(),
                         row.is_candidate ? "candidate" : "tracked");
  }
  // finish() tells of what could not be written.
  (void)std::fwrite(lines.data(), 1, lines.size(), file_.get());
  rows_ += rows.size();
}

Expected<void> TrackTable::finish() {
  const bool written = std::ferror(file_.get()) == 0 && std::fflush(file_.get()) == 0;
  if (!written || std::fclose(file_.release()) != 0) {
    return fail(path_ + ": cannot be written: " + std::generic_category().message(errno));
  }
  return whole_.finish();
}

}  // namespace perimap
