// Files that are written: there when they are whole, and not before.
#pragma once

#include <filesystem>
#include <string>

#include "core/error/expected.hpp"

namespace perimap {

// A file on its way. It is written under another name beside its own, and gets its own when all of it has reached the
// disk; until then, and when it never comes so far, what was there before stays as it was. What is there and is no
// regular file (a pipe, /dev/stdout) is written to directly.
//
// Errors name the file, not the other name: "heart.mcap: cannot be written: No space left on device".
class WholeFile {
 public:
  // How the other name is made: FILE.part, or FILE.part.mkv for those who tell the kind of file by its ending;
  // FILE.part-2 and so on where there is one already, which is left alone.
  enum class Name { kPart, kPartWithEnding };
  // Who may read it: as the process's mask and the file before have it, or the owner alone.
  enum class Readers { kAsBefore, kOwner };

  // Makes the file under its other name, empty, so that a folder that takes none is found before the work begins.
  [[nodiscard]] static Expected<WholeFile> create(const std::filesystem::path& file, Name name = Name::kPart,
                                                  Readers readers = Readers::kAsBefore);

  WholeFile(WholeFile&& other) noexcept;
  WholeFile& operator=(WholeFile&&) = delete;
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;
  ~WholeFile();  // takes away what is not finished

  // Where to write: open it anew, by this name.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return partial_; }
  // After the writer has closed it: brings it to the disk and gives it its name.
  [[nodiscard]] Expected<void> finish();
  // Or leaves what there is of it under its other name: for what nobody could make again.
  void keep_unfinished() noexcept { unfinished_ = false; }

 private:
  WholeFile(std::filesystem::path named, std::filesystem::path file, std::filesystem::path partial)
      : named_(std::move(named)), file_(std::move(file)), partial_(std::move(partial)) {}
  [[nodiscard]] bool direct() const noexcept { return partial_ == file_; }

  std::filesystem::path named_;    // as it was asked for, for messages
  std::filesystem::path file_;     // without links, so that a link stays one
  std::filesystem::path partial_;  // file_ itself: written to directly
  bool unfinished_ = true;
};

// Whether the file could be written now; nothing is left of the trial.
[[nodiscard]] Expected<void> check_writable(const std::filesystem::path& file);

// There, and no regular file (a pipe, a device, a folder), or one that is known by a descriptor alone (/dev/stdout).
[[nodiscard]] bool is_special(const std::filesystem::path& file);

}  // namespace perimap
