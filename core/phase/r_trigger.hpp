// R peaks from a hardware trigger: a monitor's synchronisation pulse that follows each R peak by a constant time.
#pragma once

#include <chrono>
#include <optional>

#include "core/phase/r_peak.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct RTriggerSettings {
  Duration delay = std::chrono::milliseconds(0);      // of the pulse after the R peak, as measured for the monitor
  Duration deviation = std::chrono::milliseconds(4);  // of that delay from beat to beat
  // A pulse so soon after the last one is its bounce or an echo.
  Duration refractory = std::chrono::milliseconds(200);
};

class RTrigger {
 public:
  explicit RTrigger(const RTriggerSettings& settings) noexcept : settings_(settings) {}

  // A pulse with its own stamp, known at `arrival`. Nothing for a bounce, or for a stamp that does not advance.
  // Monitors tell neither shape nor doubt: the confidence is 1 and the shape of no points, and classing goes by the
  // interval.
  [[nodiscard]] std::optional<RPeak> push(Instant pulse, Instant arrival) noexcept;

 private:
  RTriggerSettings settings_;
  bool has_last_ = false;
  Instant last_;
};

}  // namespace perimap
