// Breaths in the samples of a respiration channel: when each began and how long they last, causally.
//
// The signal is averaged over twentieths of a second. A turn counts when it is a good part of the range of the last
// seconds, so that heart beats and noise within a breath do not; a breath begins where the signal rises through half a
// usual rise above its last trough, which a wandering baseline hardly moves. Any unit, any gain, either polarity.
//
// A period is known once two successive ones agree, and no more when the next beginning is overdue: of a ventilator
// that pauses, of a patient who holds his breath, and of a channel in which nobody breathes, nothing is said.
//
// No heap, no locks.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

#include "core/phase/recent_values.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What the channel tells: the phase of breathing is 2 pi (t - onset) / period.
struct BreathSignal {
  std::uint64_t onsets = 0;  // since the start; 0: no breath was seen
  Instant onset;             // of the newest breath
  Duration period{0};        // of the newest breaths; 0: not known
  Duration deviation{0};     // standard deviation of an onset from where the one before and the period have it
  Instant heard_until;       // the newest sample

  [[nodiscard]] bool heard(Instant now) const noexcept;
  // Whether the phase is known at `now`: the channel is heard, and breathes regularly.
  [[nodiscard]] bool known(Instant now) const noexcept;
  // Where it is known: radians since the onset, not wrapped.
  [[nodiscard]] double phase_at(Instant t) const noexcept;
};

struct BreathDetectorSettings {
  Duration shortest_period = std::chrono::seconds(2);
  Duration longest_period = std::chrono::seconds(10);
};

class BreathDetector {
 public:
  explicit BreathDetector(const BreathDetectorSettings& settings = {}) noexcept : settings_(settings) {}

  // In order of time.
  void push(Instant t, double value) noexcept;
  // The sensor is off, or samples are missing: what was seen of the running breath is void.
  void interrupt() noexcept;

  [[nodiscard]] const BreathSignal& signal() const noexcept { return signal_; }

 private:
  struct Point {
    Instant time;
    double value = 0.0;
  };
  // Of one second.
  struct Range {
    double lowest = 0.0;
    double highest = 0.0;
  };

  void add(const Point& point) noexcept;
  void follow_range(const Point& point) noexcept;
  void look_for_onset(const Point& point) noexcept;
  void begin_breath(Instant onset) noexcept;
  void forget_period() noexcept;

  static constexpr std::size_t kRangeSeconds = 12;

  BreathDetectorSettings settings_;
  BreathSignal signal_;

  // The average that is being made.
  Instant bin_begin_;
  Duration bin_time_{0};  // sum since bin_begin_
  double bin_value_ = 0.0;
  int bin_count_ = 0;

  bool any_ = false;  // of what follows
  Point last_;
  Point trough_;
  Point peak_;
  bool rising_ = false;
  bool begun_ = false;  // a breath has begun in the running rise
  std::array<Range, kRangeSeconds> ranges_{};
  std::uint64_t range_count_ = 0;
  Instant range_begin_;
  RecentValues<5> rises_;
  RecentValues<5> periods_s_;
  double last_period_s_ = 0.0;
  int agreed_ = 0;  // periods in a row, each with the one before
  double variance_s2_ = 0.0;
  bool in_breath_ = false;  // the next onset ends a period
};

}  // namespace perimap
