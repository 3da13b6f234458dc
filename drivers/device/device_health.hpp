// How a device is doing: written by the thread that reads it, read by status, probe and log.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "core/realtime/counter.hpp"
#include "core/realtime/latency_histogram.hpp"

namespace perimap {

enum class DeviceState : std::uint8_t {
  kClosed,     // not reachable; reason() says why
  kStarting,   // open, not yet delivering
  kStreaming,  // samples come
  kSilent,     // open, but samples have stopped coming, or none can be stamped
};

[[nodiscard]] const char* device_state_name(DeviceState state) noexcept;

struct DeviceCounters {
  Counter samples;          // delivered
  Counter lost;             // by the device's own count
  Counter misnumbered;      // whose number went back or jumped, and which nobody was given
  Counter damaged;          // messages that failed their check, or bytes that fit nowhere
  Counter dropped;          // by the kernel's own count, before we could read them
  Counter bus_errors;       // CAN error frames
  Counter openings;         // times that the link was opened
  LatencyHistogram jitter;  // arrival of a sample later than the earliest it could have come
};

class DeviceHealth : public DeviceCounters {
 public:
  // Relaxed: the state is a message by itself; who needs the reason with it takes the lock.
  void set_state(DeviceState state) noexcept { state_.store(state, std::memory_order_relaxed); }
  [[nodiscard]] DeviceState state() const noexcept { return state_.load(std::memory_order_relaxed); }

  // What happened last, one line; `identity` is what the device says that it is.
  void set_reason(std::string reason);
  [[nodiscard]] std::string reason() const;
  void set_identity(std::string identity);
  [[nodiscard]] std::string identity() const;
  // What the user should know of a device that is used all the same, one line; empty: nothing.
  void set_notice(std::string notice);
  [[nodiscard]] std::string notice() const;
  // How far a device that is starting has come and what is awaited of it: a sentence for the user.
  void set_awaited(std::string awaited);
  [[nodiscard]] std::string awaited() const;

 private:
  std::atomic<DeviceState> state_{DeviceState::kClosed};
  mutable std::mutex mutex_;  // of the texts, which change when a link opens, starts or closes
  std::string reason_;
  std::string identity_;
  std::string awaited_;
  std::string notice_;
};

}  // namespace perimap
