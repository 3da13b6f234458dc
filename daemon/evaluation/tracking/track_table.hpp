// Tracks as a table: frame,id,x,y,state.
#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "core/error/expected.hpp"
#include "core/following/confirmed_tracks.hpp"
#include "drivers/file/whole_file.hpp"

namespace perimap {

// The file has its name when finish() has succeeded.
class TrackTable {
 public:
  [[nodiscard]] static Expected<TrackTable> create(const std::string& path);

  void write(std::span<const TrackRow> rows);
  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }
  [[nodiscard]] Expected<void> finish();

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { (void)std::fclose(file); }
  };
  using File = std::unique_ptr<std::FILE, Close>;

  TrackTable(std::string path, WholeFile whole, File file)
      : path_(std::move(path)), whole_(std::move(whole)), file_(std::move(file)) {}

  std::string path_;
  WholeFile whole_;  // goes after what writes to it
  File file_;
  std::size_t rows_ = 0;
};

}  // namespace perimap
