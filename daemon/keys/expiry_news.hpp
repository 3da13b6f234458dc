// When the end of a program's keys is told while it runs.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "daemon/keys/key_folder.hpp"

namespace perimap {

// Once a day from weeks before the end on, and at the end.
class ExpiryNews {
 public:
  // Of no keys: there is never any.
  ExpiryNews() = default;
  explicit ExpiryNews(KeyFacts keys) : keys_(std::move(keys)) {}

  // A line for the log when there is one to tell.
  [[nodiscard]] std::optional<std::string> next(std::chrono::sys_seconds now) {
    if (!keys_ || now < next_) return std::nullopt;
    auto warning = expiry_warning(*keys_, now);
    next_ = warning ? std::min(now + std::chrono::days(1), now < keys_->ends ? keys_->ends : now + std::chrono::days(1))
                    : std::max(now + std::chrono::minutes(1), keys_->ends - kKeysToldBefore);
    return warning;
  }

 private:
  std::optional<KeyFacts> keys_;
  std::chrono::sys_seconds next_{};
};

}  // namespace perimap
