#include "drivers/transport/serial_port.hpp"

// The kernel's termios2 takes any rate as a number; glibc's termios has a constant for some. Both headers cannot be
// included together.
#include <asm/termbits.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace perimap {
namespace {

// ioctl numbers of asm-generic, which asm/ioctls.h would give together with clashing declarations.
constexpr unsigned long kBreakForDuration = 0x5425;  // TCSBRKP; argument in tenths of a second

class SerialPort final : public ByteStream {
 public:
  SerialPort(Descriptor descriptor, std::string path) : descriptor_(std::move(descriptor)), path_(std::move(path)) {}
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;
  ~SerialPort() override { release_serial_line(descriptor_); }

  Expected<std::size_t> read(std::span<std::byte> buffer) override {
    return read_available(descriptor_.get(), buffer, path_.c_str());
  }
  Expected<std::size_t> write(std::span<const std::byte> bytes) override {
    return write_available(descriptor_.get(), bytes, path_.c_str());
  }
  int descriptor() const noexcept override { return descriptor_.get(); }
  double byte_time_ns() const noexcept override { return baud_ > 0 ? 10.0e9 / baud_ : 0.0; }

  Expected<void> set_line_rate(int baud) override {
    struct termios2 settings {};
    if (::ioctl(descriptor_.get(), TCGETS2, &settings) != 0) return refuse("is not a serial line");
    settings.c_iflag = 0;
    settings.c_oflag = 0;
    settings.c_lflag = 0;
    settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER | (BOTHER << IBSHIFT);
    settings.c_ispeed = static_cast<speed_t>(baud);
    settings.c_ospeed = static_cast<speed_t>(baud);
    // With VMIN 0 a read without data would look like a hang-up.
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    if (::ioctl(descriptor_.get(), TCSETSW2, &settings) != 0) return refuse(fmt::format("refuses {} baud", baud));
    // The driver takes the nearest rate it can make and says so; UARTs bear 2 %.
    if (::ioctl(descriptor_.get(), TCGETS2, &settings) != 0) return refuse("is not a serial line");
    const double made = settings.c_ospeed;
    if (made < 0.98 * baud || made > 1.02 * baud) {
      return fail(fmt::format("{}: cannot make {} baud, only {}", path_, baud, settings.c_ospeed));
    }
    baud_ = baud;
    return {};
  }

  Expected<void> send_break() override {
    if (::ioctl(descriptor_.get(), kBreakForDuration, 3) != 0) return refuse("cannot send a break");
    return {};
  }

  void request_low_latency() noexcept {
    serial_struct serial{};
    if (::ioctl(descriptor_.get(), TIOCGSERIAL, &serial) != 0) return;
    // NOLINTNEXTLINE(hicpp-signed-bitwise): the kernel's field is signed
    serial.flags |= ASYNC_LOW_LATENCY;
    // Not every driver has it, and those that have not are fast already or cannot be helped.
    (void)::ioctl(descriptor_.get(), TIOCSSERIAL, &serial);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& what) const {
    return fail(fmt::format("{}: {}: {}", path_, what, std::generic_category().message(errno)));
  }

  Descriptor descriptor_;
  std::string path_;
  int baud_ = 0;
};

std::string reason_not_opened(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return fmt::format("{}: no such device; is it plugged in and switched on?", path);
    case EACCES:
    case EPERM:
      return fmt::format("{}: permission denied; add the user to the device's group (ls -l says which, often dialout)",
                         path);
    case EBUSY:
      return fmt::format("{}: in use by another program", path);
    default:
      return fmt::format("{}: cannot open: {}", path, std::generic_category().message(error));
  }
}

}  // namespace

Expected<Descriptor> claim_serial_line(const std::string& path) {
  // Non-blocking also while opening: a line without carrier would wait for it.
  Descriptor descriptor(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!descriptor) return fail(reason_not_opened(path, errno));
  struct termios2 probe {};
  if (::ioctl(descriptor.get(), TCGETS2, &probe) != 0) return fail(fmt::format("{}: not a serial line", path));
  // TIOCEXCL does not keep root out, a lock does not keep out programs that take none: both together.
  if (::flock(descriptor.get(), LOCK_EX | LOCK_NB) != 0) {
    return fail(reason_not_opened(path, errno == EWOULDBLOCK ? EBUSY : errno));
  }
  (void)::ioctl(descriptor.get(), TIOCEXCL);
  return descriptor;
}

void release_serial_line(const Descriptor& line) noexcept { (void)::ioctl(line.get(), TIOCNXCL); }

Expected<void> ignore_carrier(const Descriptor& line, const std::string& path) {
  struct termios2 settings {};
  if (::ioctl(line.get(), TCGETS2, &settings) != 0) return fail(fmt::format("{}: not a serial line", path));
  settings.c_cflag |= CLOCAL;
  if (::ioctl(line.get(), TCSETS2, &settings) != 0) {
    return fail(fmt::format("{}: cannot be set up: {}", path, std::generic_category().message(errno)));
  }
  return {};
}

Expected<std::unique_ptr<ByteStream>> open_serial_port(const std::string& path, int baud) {
  auto descriptor = claim_serial_line(path);
  if (!descriptor) return tl::unexpected(std::move(descriptor.error()));
  auto port = std::make_unique<SerialPort>(std::move(*descriptor), path);
  if (auto set = port->set_line_rate(baud); !set) return tl::unexpected(std::move(set.error()));
  port->request_low_latency();
  // What came before the line was set up was read at another rate.
  (void)::ioctl(port->descriptor(), TCFLSH, TCIFLUSH);
  return port;
}

}  // namespace perimap
