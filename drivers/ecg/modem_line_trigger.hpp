// The R peaks that a trigger monitor shows on a modem line of a serial port, such as carrier detect: one pulse a beat,
// 0 to 5 V or more, some 100 ms long, whose edge is the R peak.
//
// tty_ioctl(4): TIOCMIWAIT sleeps until a line changes, TIOCGICOUNT counts the changes. The stamp is that of the
// waking, microseconds late on a port of the machine, up to a millisecond over USB.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "core/sensors/r_trigger_pulse.hpp"
#include "core/time/instant.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/ecg/modem_line.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

struct ModemTriggerSettings {
  std::string path;
  ModemLine line = ModemLine::kCarrierDetect;
  bool rising = true;                                           // the line goes on at the R peak; otherwise off
  Duration shortest_interval = std::chrono::milliseconds(200);  // 300 beats a minute; what is closer is a bounce
};

// The pulses' count rises by one a trigger, over all openings.
using RTriggerSink = std::function<void(const RTriggerPulse&)>;

// The few calls by which the line is watched: the seam between what the kernel does and what we make of it.
class ModemPort {
 public:
  struct Line {
    std::uint32_t changes = 0;  // of either direction, since whenever; goes over its end
    bool on = false;
  };

  virtual ~ModemPort() = default;
  // True when the line changed meanwhile. False when it did not for a while, so that the caller may look about.
  [[nodiscard]] virtual Expected<bool> wait_for_change() = 0;
  [[nodiscard]] virtual Expected<Line> read() = 0;
};

// For the calling thread alone, and the port for it alone among programs. Errors name the path and what to do, also of
// a port without modem lines.
[[nodiscard]] Expected<std::unique_ptr<ModemPort>> open_modem_port(const std::string& path, ModemLine line);

// Which changes of the line are R peaks. A change whose instant is not known, because more than one came at once or
// nobody was waiting, gives none: a late R peak is worse than a missing one, which the clock bridges.
class TriggerEdges {
 public:
  TriggerEdges(const ModemTriggerSettings& settings, DeviceHealth& health) : settings_(settings), health_(health) {}

  // The line as it is found at an opening.
  void restart(const ModemPort::Line& line) noexcept { changes_ = line.changes; }
  // As it is at `now`, right after a wait that did or did not end by a change.
  [[nodiscard]] std::optional<RTriggerPulse> observe_line(const ModemPort::Line& line, bool woken,
                                                          Instant now) noexcept;

 private:
  ModemTriggerSettings settings_;
  DeviceHealth& health_;
  std::uint32_t changes_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t others_ = 0;  // edges the other way, since the last one of an R peak
  Instant last_{};
};

using ModemPortOpener = std::function<Expected<std::unique_ptr<ModemPort>>(const std::string& path, ModemLine line)>;

// Runs on the calling thread until interrupted, which it notices within a quarter of a second. Three seconds without a
// trigger are silence. health: samples are triggers, lost are edges without a known instant, damaged are bounces.
void serve_modem_line_trigger(const ModemTriggerSettings& settings, const RTriggerSink& sink, DeviceHealth& health,
                              const Interrupt& interrupt, const ModemPortOpener& open = &open_modem_port);

}  // namespace perimap
