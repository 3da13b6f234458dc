#include "drivers/file/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>

namespace perimap {
namespace {

constexpr std::chrono::milliseconds kReaderAwaited{1000};
constexpr std::chrono::milliseconds kAskedEvery{10};

std::string reason(int error) { return std::generic_category().message(error); }

bool is_pipe(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::is_fifo(file, error);
}

}  // namespace

tl::expected<Descriptor, std::string> open_output_file(const std::filesystem::path& file) {
  // Without O_NONBLOCK this call would be what waits; on a regular file the flag does nothing.
  constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC | O_NONBLOCK | O_NOCTTY | O_CLOEXEC;
  Descriptor descriptor(::open(file.c_str(), kFlags, S_IRUSR | S_IWUSR));
  for (auto waited = kAskedEvery; !descriptor && errno == ENXIO && is_pipe(file); waited += kAskedEvery) {
    if (waited > kReaderAwaited) return tl::unexpected(std::string("a pipe that nobody reads from"));
    std::this_thread::sleep_for(kAskedEvery);
    descriptor = Descriptor(::open(file.c_str(), kFlags, S_IRUSR | S_IWUSR));
  }
  if (!descriptor) return tl::unexpected(reason(errno));
  // What is written waits for whoever reads.
  if (::fcntl(descriptor.get(), F_SETFL, O_WRONLY) == 0) return descriptor;
  return tl::unexpected(reason(errno));
}

}  // namespace perimap
