// A folder for what the runs of a benchmark write.
#pragma once

#include <filesystem>
#include <utility>

#include "core/error/expected.hpp"

namespace perimap::bench {

// Gone when this is.
class ScratchFolder {
 public:
  [[nodiscard]] static Expected<ScratchFolder> create(const std::filesystem::path& in);
  ScratchFolder(ScratchFolder&& other) noexcept : path_(std::move(other.path_)) { other.path_.clear(); }
  ScratchFolder& operator=(ScratchFolder&&) = delete;
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder();

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  explicit ScratchFolder(std::filesystem::path path) : path_(std::move(path)) {}

  std::filesystem::path path_;
};

}  // namespace perimap::bench
