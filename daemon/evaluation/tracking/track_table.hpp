// Tracks as a table: frame,id,x,y,state.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/error/expected.hpp"
#include "core/following/confirmed_tracks.hpp"
#include "drivers/file/c_stream.hpp"
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
  TrackTable(std::string path, WholeFile whole, CStream file)
      : path_(std::move(path)), whole_(std::move(whole)), file_(std::move(file)) {}

  std::string path_;
  WholeFile whole_;  // goes after what writes to it
  CStream file_;
  std::size_t rows_ = 0;
};

}  // namespace perimap
