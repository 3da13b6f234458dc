// From a device's own count (samples, frames, ticks) to the host's clock, by when the counts arrived.
#pragma once

#include <array>
#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

struct ArrivalClockSettings {
  double period_ns = 0.0;         // nominal, of one count
  Duration transport_delay{0};    // known and constant, from measurement to the earliest possible arrival
  double rate_tolerance = 0.005;  // by how much the device's clock may differ from nominal
};

// Arrivals are late by a varying amount and never early, so the device's clock runs along the lower edge of arrival
// against count. That edge is the side of the points' lower convex hull above their mean count: the line below all
// points with the least mean distance (Moon, Skelly & Towsley, "Estimation and removal of clock skew from network delay
// measurements", INFOCOM 1999). Of every quarter second the earliest point is kept, for ten seconds.
//
// Late bursts, buffered chunks and scheduling delays thus do not move the stamps. A step of the edge (samples lost
// without a word, a device that started its clock anew) is taken over after half a second when it is late, and at once
// when it is early.
class ArrivalClock {
 public:
  explicit ArrivalClock(const ArrivalClockSettings& settings) noexcept : settings_(settings) {}

  // Count `count` arrived. Counts may be left out and may repeat; one that goes back, or an hour on, starts the clock
  // anew.
  void observe(std::int64_t count, Instant arrival) noexcept;
  void reset() noexcept { started_ = false; }

  [[nodiscard]] bool started() const noexcept { return started_; }
  // When the count was measured; not after the arrival of any count observed. Needs started().
  [[nodiscard]] Instant stamp(std::int64_t count) const noexcept;
  // Of one count, as fitted.
  [[nodiscard]] double period_ns() const noexcept { return settings_.period_ns + slope_; }
  // How much later than the edge an arrival is.
  [[nodiscard]] Duration lateness(std::int64_t count, Instant arrival) const noexcept;
  // The count that would be arriving now at the earliest.
  [[nodiscard]] double count_at(Instant arrival) const noexcept;

 private:
  // Arrival against count, less the nominal line through the first of them.
  struct Point {
    double count = 0.0;  // since origin_count_
    double late_ns = 0.0;
  };
  static constexpr std::size_t kIntervals = 40;
  static constexpr double kInterval_ns = 250e6;
  static constexpr double kShortestSpan_ns = 1e9;  // before it the nominal rate is better than a fitted one
  static constexpr double kStep_ns = 20e6;
  static constexpr int kLateIntervals = 2;
  static constexpr double kLongestGap_ns = 3600e9;

  void start(std::int64_t count, Instant arrival) noexcept;
  void close_interval() noexcept;
  void fit() noexcept;
  [[nodiscard]] double edge(double count) const noexcept { return offset_ + slope_ * count; }
  [[nodiscard]] Point point(std::int64_t count, Instant arrival) const noexcept;

  ArrivalClockSettings settings_;
  bool started_ = false;
  std::int64_t origin_count_ = 0;
  Instant origin_;
  std::int64_t last_count_ = 0;
  std::array<Point, kIntervals> earliest_{};  // of closed intervals, oldest first
  std::size_t intervals_ = 0;
  Point current_;  // the earliest of the open interval
  double interval_begin_count_ = 0.0;
  int late_intervals_ = 0;
  double offset_ = 0.0;  // ns
  double slope_ = 0.0;   // ns a count, on top of nominal
};

}  // namespace perimap
