#include "drivers/device/device_health.hpp"

#include <utility>

#include "core/error/one_line.hpp"

namespace perimap {

const char* device_state_name(DeviceState state) noexcept {
  switch (state) {
    case DeviceState::kStarting:
      return "starting";
    case DeviceState::kStreaming:
      return "streaming";
    case DeviceState::kSilent:
      return "silent";
    case DeviceState::kClosed:
      break;
  }
  return "closed";
}

void DeviceHealth::set_reason(std::string reason) {
  const std::lock_guard lock(mutex_);
  reason_ = on_one_line(std::move(reason));
}

std::string DeviceHealth::reason() const {
  const std::lock_guard lock(mutex_);
  return reason_;
}

void DeviceHealth::set_identity(std::string identity) {
  const std::lock_guard lock(mutex_);
  identity_ = on_one_line(std::move(identity));
}

std::string DeviceHealth::identity() const {
  const std::lock_guard lock(mutex_);
  return identity_;
}

void DeviceHealth::set_notice(std::string notice) {
  const std::lock_guard lock(mutex_);
  notice_ = on_one_line(std::move(notice));
}

std::string DeviceHealth::notice() const {
  const std::lock_guard lock(mutex_);
  return notice_;
}

void DeviceHealth::set_awaited(std::string awaited) {
  const std::lock_guard lock(mutex_);
  awaited_ = on_one_line(std::move(awaited));
}

std::string DeviceHealth::awaited() const {
  const std::lock_guard lock(mutex_);
  return awaited_;
}

}  // namespace perimap
