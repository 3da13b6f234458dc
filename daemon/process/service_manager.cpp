#include "daemon/process/service_manager.hpp"

#include <systemd/sd-daemon.h>

#include <algorithm>

namespace perimap {
namespace {

// Of the watchdog's interval; two feedings may be late before it strikes.
constexpr int kFeedingsAnInterval = 4;

}  // namespace

ServiceManager::ServiceManager() {
  std::uint64_t interval_us = 0;
  if (sd_watchdog_enabled(0, &interval_us) > 0) {
    feeding_interval_ = std::chrono::microseconds(interval_us) / kFeedingsAnInterval;
  }
}

void ServiceManager::ready() { notify("READY=1"); }

void ServiceManager::stopping() { notify("STOPPING=1"); }

void ServiceManager::tell_status(const std::string& line) {
  if (line == told_status_) return;
  told_status_ = line;
  std::string text = "STATUS=" + line;
  std::replace(text.begin(), text.end(), '\n', ' ');  // ends an assignment in the datagram
  notify(text);
}

void ServiceManager::feed_watchdog(std::uint64_t beats, Instant now) {
  if (feeding_interval_ == Duration(0) || now < next_feeding_ || beats == fed_beats_) return;
  fed_beats_ = beats;
  next_feeding_ = now + feeding_interval_;
  notify("WATCHDOG=1");
}

void ServiceManager::notify(const std::string& state) const {
  // A manager that does not listen is no reason to stop publishing; systemd itself acts on a missing datagram.
  static_cast<void>(sd_notify(0, state.c_str()));
}

}  // namespace perimap
