#include "drivers/recording/byte_source.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "drivers/file/regular_file.hpp"
#include "drivers/recording/errno_text.hpp"

namespace perimap {
namespace {

class FileSource final : public ByteSource {
 public:
  FileSource(Descriptor file, std::uint64_t size) noexcept : file_(std::move(file)), size_(size) {}

  std::uint64_t size() const noexcept override { return size_; }

  Expected<void> read_at(std::uint64_t offset, std::span<std::byte> bytes) override {
    while (!bytes.empty()) {
      const ssize_t got = ::pread(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (got < 0) {
        if (errno == EINTR) continue;
        return fail(fmt::format("byte {}: cannot read: {}", offset, errno_text(errno)));
      }
      if (got == 0) return fail(fmt::format("byte {}: the file has become shorter", offset));
      offset += static_cast<std::uint64_t>(got);
      bytes = bytes.subspan(static_cast<std::size_t>(got));
    }
    return {};
  }

 private:
  Descriptor file_;
  std::uint64_t size_;
};

}  // namespace

Expected<std::unique_ptr<ByteSource>> open_file(const std::string& path) {
  auto opened = open_regular_file(path);
  if (!opened) return fail(fmt::format("{}: cannot open: {}", path, opened.error()));
  struct stat status {};
  if (::fstat(opened->get(), &status) != 0) return fail(fmt::format("{}: cannot examine: {}", path, errno_text(errno)));
  return std::make_unique<FileSource>(*std::move(opened), static_cast<std::uint64_t>(status.st_size));
}

}  // namespace perimap
