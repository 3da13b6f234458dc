#include "drivers/camera/v4l2_node.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "drivers/file/descriptor.hpp"

namespace perimap {
namespace {

class KernelNode final : public V4l2Node {
 public:
  explicit KernelNode(Descriptor descriptor) : descriptor_(std::move(descriptor)) {}

  int control(unsigned long request, void* argument) override {
    while (::ioctl(descriptor_.get(), request, argument) != 0) {
      if (errno != EINTR) return errno;
    }
    return 0;
  }

  std::span<std::byte> map(std::size_t length, std::int64_t offset) override {
    void* const memory = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_.get(), offset);
    if (memory == MAP_FAILED) return {};
    return {static_cast<std::byte*>(memory), length};
  }

  void unmap(std::span<std::byte> memory) noexcept override { (void)::munmap(memory.data(), memory.size()); }

  Ready wait(Duration longest, const Interrupt& interrupt) override {
    std::array<pollfd, 2> waited{{{descriptor_.get(), POLLIN | POLLPRI, 0}, {interrupt.descriptor(), POLLIN, 0}}};
    const std::timespec timeout{longest.count() / 1'000'000'000, longest.count() % 1'000'000'000};
    if (::ppoll(waited.data(), waited.size(), &timeout, nullptr) <= 0) return Ready::kNothing;
    if (waited[1].revents != 0) return Ready::kInterrupted;
    if ((waited[0].revents & POLLIN) != 0) return Ready::kBuffer;
    return (waited[0].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0 ? Ready::kError : Ready::kEvent;
  }

 private:
  Descriptor descriptor_;
};

std::string reason_not_opened(int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return "no such device; is it plugged in? ls /dev/v4l/by-id says which cameras there are";
    case EACCES:
    case EPERM:
      return "permission denied; add the user to the device's group (ls -l says which, often video)";
    case EBUSY:
      return "in use by another program";
    default:
      return std::generic_category().message(error);
  }
}

}  // namespace

Expected<std::unique_ptr<V4l2Node>> open_v4l2_node(const std::string& path) {
  Descriptor descriptor(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!descriptor) return fail(fmt::format("{}: {}", path, reason_not_opened(errno)));
  struct stat status {};
  if (::fstat(descriptor.get(), &status) != 0 || !S_ISCHR(status.st_mode)) {
    return fail(fmt::format("{}: not a video device", path));
  }
  return std::make_unique<KernelNode>(std::move(descriptor));
}

}  // namespace perimap
