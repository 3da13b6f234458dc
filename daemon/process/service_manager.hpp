// What systemd is told of the service while it runs, sd_notify(3).
#pragma once

#include <cstdint>
#include <string>

#include "core/time/instant.hpp"

namespace perimap {

// Does nothing when the process was not started by a service manager. One thread at a time, and none of the real-time
// ones: every call that tells something is a datagram.
class ServiceManager {
 public:
  // Reads $NOTIFY_SOCKET and $WATCHDOG_USEC.
  ServiceManager();

  // The service has started: it publishes, or says why it cannot.
  void ready();
  void stopping();

  // One line for `systemctl status`; sent when it is another than before.
  void tell_status(const std::string& line);

  // `beats`: a count that the watched thread raises at least four times in a watchdog interval. The watchdog is fed
  // only when the count has moved since it was fed last, so a hung thread is noticed although the caller is well.
  void feed_watchdog(std::uint64_t beats, Instant now);

 private:
  void notify(const std::string& state) const;

  Duration feeding_interval_{0};  // 0: there is no watchdog
  Instant next_feeding_{};
  std::uint64_t fed_beats_ = 0;
  std::string told_status_;
};

}  // namespace perimap
