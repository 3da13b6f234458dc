// A segment of the black box that is being written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/black_box/entry.hpp"
#include "daemon/black_box/segment_header.hpp"
#include "drivers/file/descriptor.hpp"

namespace perimap::black_box {

// "segment-00000012" in the folder.
[[nodiscard]] std::filesystem::path segment_path(const std::filesystem::path& folder, std::uint64_t number);

// Each entry is one write, so that a process that is killed leaves whole ones. Errors name the file.
class SegmentFile {
 public:
  // Makes the file, for its owner alone, with `header` in it, and room for `reserved` bytes where the disk has that: a
  // disk that others fill meanwhile takes nothing from it. It has its name only with a whole header.
  [[nodiscard]] static Expected<SegmentFile> create(const std::filesystem::path& folder, const SegmentHeader& header,
                                                    const Entry& entry, std::uint64_t reserved);

  // As a whole or not at all.
  [[nodiscard]] Expected<void> append(const Entry& entry);
  // Onto the disk.
  [[nodiscard]] Expected<void> synchronise();
  // Gives back the room that was not used, after the last entry.
  void release_room();
  // As a later segment's header tells of it.
  [[nodiscard]] const PresentSegment& facts() const noexcept { return facts_; }

 private:
  SegmentFile(Descriptor descriptor, std::filesystem::path path, std::uint64_t number);

  Descriptor descriptor_;
  std::filesystem::path path_;
  PresentSegment facts_;
};

}  // namespace perimap::black_box
