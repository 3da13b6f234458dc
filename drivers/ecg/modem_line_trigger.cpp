#include "drivers/ecg/modem_line_trigger.hpp"

#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <ctime>
#include <system_error>
#include <utility>

#include "drivers/device/reopening.hpp"
#include "drivers/file/descriptor.hpp"
#include "drivers/transport/serial_port.hpp"

namespace perimap {
namespace {

constexpr Duration kSilentAfter = std::chrono::seconds(3);

struct LineBits {
  int mask;  // of TIOCMIWAIT and TIOCMGET
  int serial_icounter_struct::*count;
};

LineBits bits_of(ModemLine line) noexcept {
  switch (line) {
    case ModemLine::kClearToSend:
      return {TIOCM_CTS, &serial_icounter_struct::cts};
    case ModemLine::kDataSetReady:
      return {TIOCM_DSR, &serial_icounter_struct::dsr};
    case ModemLine::kRingIndicator:
      return {TIOCM_RNG, &serial_icounter_struct::rng};
    case ModemLine::kCarrierDetect:
      break;
  }
  return {TIOCM_CD, &serial_icounter_struct::dcd};
}

// TIOCMIWAIT knows no time limit and no other descriptor; only a signal ends it. So the thread that waits is sent one
// five times a second, which does nothing but that.
class WaitLimit {
 public:
  WaitLimit() {
    const int signal = SIGRTMIN;
    struct sigaction action {};
    action.sa_handler = [](int) {};  // without SA_RESTART: the call must end
    (void)::sigaction(signal, &action, nullptr);
    sigevent event{};
    event.sigev_notify = SIGEV_THREAD_ID;
    event.sigev_signo = signal;
    event._sigev_un._tid = ::gettid();  // NOLINT(cppcoreguidelines-pro-type-union-access): glibc 2.36 has no other name
    armed_ = ::timer_create(CLOCK_MONOTONIC, &event, &timer_) == 0;
    constexpr long kPeriod_ns = 200'000'000;
    const itimerspec period{{0, kPeriod_ns}, {0, kPeriod_ns}};
    armed_ = armed_ && ::timer_settime(timer_, 0, &period, nullptr) == 0;
  }
  WaitLimit(const WaitLimit&) = delete;
  WaitLimit& operator=(const WaitLimit&) = delete;
  ~WaitLimit() {
    if (armed_) (void)::timer_delete(timer_);
  }

  [[nodiscard]] bool armed() const noexcept { return armed_; }

 private:
  timer_t timer_{};
  bool armed_ = false;
};

class KernelPort final : public ModemPort {
 public:
  KernelPort(Descriptor descriptor, std::string path, ModemLine line)
      : descriptor_(std::move(descriptor)), path_(std::move(path)), bits_(bits_of(line)) {}
  KernelPort(const KernelPort&) = delete;
  KernelPort& operator=(const KernelPort&) = delete;
  ~KernelPort() override { release_serial_line(descriptor_); }

  Expected<bool> wait_for_change() override {
    if (!limit_.armed()) return fail(path_ + ": no timer for waiting");
    if (::ioctl(descriptor_.get(), TIOCMIWAIT, bits_.mask) == 0) return true;
    if (errno == EINTR) return false;
    return refuse();
  }

  Expected<Line> read() override {
    int levels = 0;
    serial_icounter_struct counts{};
    // The level last: it is then not older than the count.
    if (::ioctl(descriptor_.get(), TIOCGICOUNT, &counts) != 0) return refuse();
    if (::ioctl(descriptor_.get(), TIOCMGET, &levels) != 0) return refuse();
    return Line{static_cast<std::uint32_t>(counts.*bits_.count), (levels & bits_.mask) != 0};
  }

 private:
  [[nodiscard]] tl::unexpected<Error> refuse() const {
    switch (errno) {
      case ENOTTY:
      case EINVAL:
      case ENOSYS:
        return fail(path_ + ": cannot watch modem lines; expected a serial port that has them");
      case EIO:
      case ENODEV:
      case ENXIO:
        return fail(path_ + ": unplugged");
      default:
        return fail(fmt::format("{}: {}", path_, std::generic_category().message(errno)));
    }
  }

  Descriptor descriptor_;
  std::string path_;
  LineBits bits_;
  WaitLimit limit_;
};

// Until the port fails (the reason is returned) or the interrupt is requested (empty then).
std::string watch_line(ModemPort& port, TriggerEdges& edges, const RTriggerSink& sink, DeviceHealth& health,
                       const Interrupt& interrupt) {
  const auto found = port.read();
  if (!found) return found.error().message;
  edges.restart(*found);
  Instant last = MonotonicClock::now();
  while (!interrupt.requested()) {
    const auto woken = port.wait_for_change();
    const Instant now = MonotonicClock::now();
    if (!woken) return woken.error().message;
    const auto line = port.read();
    if (!line) return line.error().message;
    if (const auto trigger = edges.observe_line(*line, *woken, now)) {
      last = now;
      health.set_state(DeviceState::kStreaming);
      sink(*trigger);
    } else if (now - last > kSilentAfter && health.state() == DeviceState::kStreaming) {
      health.set_state(DeviceState::kSilent);
    }
  }
  return "";
}

}  // namespace

Expected<std::unique_ptr<ModemPort>> open_modem_port(const std::string& path, ModemLine line) {
  auto claimed = claim_serial_line(path);
  if (!claimed) return tl::unexpected(std::move(claimed.error()));
  // A monitor that pulls carrier detect off after each beat does not hang up.
  if (auto set = ignore_carrier(*claimed, path); !set) {
    release_serial_line(*claimed);
    return tl::unexpected(std::move(set.error()));
  }
  auto port = std::make_unique<KernelPort>(std::move(*claimed), path, line);
  if (const auto read = port->read(); !read) return tl::unexpected(read.error());
  return port;
}

std::optional<RTriggerPulse> TriggerEdges::observe_line(const ModemPort::Line& line, bool woken, Instant now) noexcept {
  const std::uint32_t changes = line.changes - changes_;
  changes_ = line.changes;
  if (changes == 0) return std::nullopt;
  if (!woken || changes > 1) {
    // Of n changes that end at this level, so many went to the level of an R peak.
    health_.lost.add((changes + (line.on == settings_.rising ? 1 : 0)) / 2);
    return std::nullopt;
  }
  if (line.on != settings_.rising) {
    constexpr std::uint32_t kOthersInARow = 3;
    if (++others_ == kOthersInARow) {
      health_.set_awaited(
          fmt::format("only the {} edge comes (of ri, many ports tell no other); should ecg.r_trigger_edge be that?",
                      settings_.rising ? "falling" : "rising"));
    }
    return std::nullopt;
  }
  others_ = 0;
  if (count_ > 0 && now - last_ < settings_.shortest_interval) {
    health_.damaged.add();
    return std::nullopt;
  }
  last_ = now;
  health_.samples.add();
  return RTriggerPulse{now, now, ++count_};
}

void serve_modem_line_trigger(const ModemTriggerSettings& settings, const RTriggerSink& sink, DeviceHealth& health,
                              const Interrupt& interrupt, const ModemPortOpener& open) {
  TriggerEdges edges(settings, health);
  serve_reopening([&] { return open(settings.path, settings.line); },
                  [&](std::unique_ptr<ModemPort>& port) { return watch_line(*port, edges, sink, health, interrupt); },
                  health, interrupt);
}

}  // namespace perimap
