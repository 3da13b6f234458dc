#include "drivers/recording/byte_sink.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "drivers/file/output_file.hpp"
#include "drivers/recording/errno_text.hpp"

namespace perimap {
namespace {

class FileSink final : public ByteSink {
 public:
  FileSink(Descriptor file, std::string path) noexcept : file_(std::move(file)), path_(std::move(path)) {}

  Expected<void> write(std::span<const std::byte> bytes) override {
    while (!bytes.empty()) {
      const ssize_t written = ::write(file_.get(), bytes.data(), bytes.size());
      if (written < 0) {
        if (errno == EINTR) continue;
        return fail(fmt::format("{}: cannot write: {}", path_, errno_text(errno)));
      }
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      written_ += written;
    }
    return written_ - begun_ < kWindow ? Expected<void>() : hand_on();
  }

  Expected<void> close() override {
    if (::close(file_.release()) != 0) return fail(fmt::format("{}: cannot close: {}", path_, errno_text(errno)));
    return {};
  }

 private:
  // The kernel would keep what is written, gigabytes of it, then write it all at once and make us wait; and what it
  // keeps takes the place of what others need. So it begins with each window at once, and forgets the one before.
  Expected<void> hand_on() {
    constexpr unsigned kDone = SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER;
    bool on_disk = ::sync_file_range(file_.get(), begun_, written_ - begun_, SYNC_FILE_RANGE_WRITE) == 0;
    if (begun_ > forgotten_) {
      on_disk = on_disk && ::sync_file_range(file_.get(), forgotten_, begun_ - forgotten_, kDone) == 0;
      if (on_disk) (void)::posix_fadvise(file_.get(), forgotten_, begun_ - forgotten_, POSIX_FADV_DONTNEED);
    }
    // What is no file on a disk (a pipe) has nothing to hand on.
    if (!on_disk && (errno == EIO || errno == ENOSPC || errno == EDQUOT)) {
      return fail(fmt::format("{}: cannot write: {}", path_, errno_text(errno)));
    }
    forgotten_ = begun_;
    begun_ = written_;
    return {};
  }

  static constexpr off_t kWindow = off_t{8} << 20;
  Descriptor file_;
  std::string path_;
  off_t written_ = 0;    // bytes in all
  off_t begun_ = 0;      // until here they are on their way to the disk
  off_t forgotten_ = 0;  // until here they are there
};

}  // namespace

Expected<std::unique_ptr<ByteSink>> create_file(const std::string& path, const std::string& told_as) {
  const std::string& name = told_as.empty() ? path : told_as;
  auto opened = open_output_file(path);
  if (!opened) return fail(fmt::format("{}: cannot create: {}", name, opened.error()));
  return std::make_unique<FileSink>(*std::move(opened), name);
}

}  // namespace perimap
