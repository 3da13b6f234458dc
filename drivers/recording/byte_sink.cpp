#include "drivers/recording/byte_sink.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace perimap {
namespace {

std::string errno_text(int error) { return std::generic_category().message(error); }

class FileSink final : public ByteSink {
 public:
  FileSink(int fd, std::string path) noexcept : fd_(fd), path_(std::move(path)) {}
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;
  ~FileSink() override {
    if (fd_ >= 0) ::close(fd_);
  }

  Expected<void> write(std::span<const std::byte> bytes) override {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written < 0) {
        if (errno == EINTR) continue;
        return fail(fmt::format("{}: cannot write: {}", path_, errno_text(errno)));
      }
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return {};
  }

  Expected<void> close() override {
    const int fd = std::exchange(fd_, -1);
    if (::close(fd) != 0) return fail(fmt::format("{}: cannot close: {}", path_, errno_text(errno)));
    return {};
  }

 private:
  int fd_;
  std::string path_;
};

}  // namespace

Expected<std::unique_ptr<ByteSink>> create_file(const std::string& path) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) return fail(fmt::format("{}: cannot create: {}", path, errno_text(errno)));
  return std::make_unique<FileSink>(fd, path);
}

}  // namespace perimap
