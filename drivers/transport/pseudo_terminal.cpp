#include "drivers/transport/pseudo_terminal.hpp"

#include <asm/termbits.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace perimap {
namespace {

Expected<void> place_link(const std::string& device, const std::string& link) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status there = fs::symlink_status(link, error);
  if (fs::exists(there) && !fs::is_symlink(there)) return fail(fmt::format("{}: exists and is not a link", link));
  // Beside it and renamed over it: the name never points to nothing of ours.
  const std::string beside = link + ".new";
  fs::remove(beside, error);
  fs::create_symlink(device, beside, error);
  if (!error) fs::rename(beside, link, error);
  if (error) return fail(fmt::format("{}: cannot link to {}: {}", link, device, error.message()));
  return {};
}

}  // namespace

Expected<std::unique_ptr<PseudoTerminal>> PseudoTerminal::open(const std::string& link) {
  const auto refuse = [] {
    return fail(fmt::format("cannot open a pseudo-terminal: {}", std::generic_category().message(errno)));
  };
  Descriptor master(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  std::array<char, 64> device{};
  if (!master || ::grantpt(master.get()) != 0 || ::unlockpt(master.get()) != 0 ||
      ::ptsname_r(master.get(), device.data(), device.size()) != 0) {
    return refuse();
  }
  Descriptor slave(::open(device.data(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  struct termios2 settings {};
  if (!slave || ::ioctl(slave.get(), TCGETS2, &settings) != 0) return refuse();
  settings.c_iflag = 0;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cc[VMIN] = 1;
  if (::ioctl(slave.get(), TCSETS2, &settings) != 0) return refuse();
  if (!link.empty()) {
    if (auto linked = place_link(device.data(), link); !linked) return tl::unexpected(std::move(linked.error()));
  }
  return std::unique_ptr<PseudoTerminal>(new PseudoTerminal(std::move(master), std::move(slave), device.data(), link));
}

PseudoTerminal::~PseudoTerminal() {
  if (link_.empty()) return;
  std::error_code ignored;
  if (std::filesystem::read_symlink(link_, ignored) == device_) std::filesystem::remove(link_, ignored);
}

Expected<std::size_t> PseudoTerminal::read(std::span<std::byte> buffer) {
  return read_available(master_.get(), buffer, path().c_str());
}

Expected<std::size_t> PseudoTerminal::write(std::span<const std::byte> bytes) {
  auto put = write_available(master_.get(), bytes, path().c_str());
  if (put && *put == 0 && !bytes.empty()) {
    // The other side does not read: a real line would lose these bytes too.
    (void)::ioctl(slave_.get(), TCFLSH, TCIFLUSH);
    return bytes.size();
  }
  return put;
}

double PseudoTerminal::byte_time_ns() const noexcept {
  const int rate = line_rate();
  return rate > 0 ? 10.0e9 / rate : 0.0;
}

int PseudoTerminal::line_rate() const noexcept {
  struct termios2 settings {};
  return ::ioctl(slave_.get(), TCGETS2, &settings) == 0 ? static_cast<int>(settings.c_ospeed) : 0;
}

}  // namespace perimap
