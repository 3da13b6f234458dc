// Whether an OpenIGTLink server's stamps are the seconds of a clock that runs as ours does.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "core/time/instant.hpp"

namespace perimap {

// A stamp is a number of seconds, 32.32 fixed point. Users have met servers that send milliseconds there, whole
// seconds, a fraction in nanoseconds, frame numbers, and a clock that runs at another pace. So stamps are held against
// arrivals, which are late by a varying amount and never early: of every quarter second the message that came earliest
// for its stamp counts. From one quarter to the next the two may differ by 30 %, over a second by 5 %, over eight by 1
// %. Three of four quarters that do not, two seconds, or two times eight, in a row and in the same direction, and the
// stamps are wrong; so are those that change twice a second at most while more messages come. They are right again when
// nothing of that has been seen for a second. A clock that is set once makes one quarter wrong, and a network that
// stands still two.
class StampCheck {
 public:
  // A message came; `stamp` is not 0, which would be none.
  void observe(std::uint64_t stamp, Instant arrival);
  // Another conversation: what is known to be wrong stays so until it is seen to be right.
  void restart() { *this = wrong_ ? StampCheck(fault_) : StampCheck(); }

  // Enough has been seen, in this conversation, to tell.
  [[nodiscard]] bool judged() const noexcept { return judged_; }
  [[nodiscard]] bool wrong() const noexcept { return wrong_; }
  // What they are instead, as "whole seconds"; empty while they are right.
  [[nodiscard]] const std::string& fault() const noexcept { return fault_; }

  // That the same stamp comes again and again.
  [[nodiscard]] bool stand_still() const noexcept { return wrong_ && fault_ == kStandStill; }

  StampCheck() = default;

 private:
  explicit StampCheck(std::string fault) : wrong_(true), fault_(std::move(fault)) {}

  static constexpr const char* kStandStill = "the same for half a second and more";
  static constexpr Duration kQuarter = std::chrono::milliseconds(250);
  static constexpr Duration kLongestGap = std::chrono::milliseconds(500);
  static constexpr Duration kLong = std::chrono::seconds(8);
  static constexpr std::size_t kQuarters = 4;  // of a second

  struct Point {
    std::uint64_t stamp = 0;
    Instant arrival;
  };
  // What the stamps of a span look like.
  struct Look {
    int messages = 0;
    int changes = 0;    // of the stamp
    bool whole = true;  // none has a fraction
    bool small = true;  // no fraction, as an integer, is a thousand million or more
  };

  [[nodiscard]] static double stamped_s(const Point& from, const Point& to) noexcept;
  // By how much stamps went farther than arrivals, s; beyond a share of the span (at least `shortest_s`) it is off.
  [[nodiscard]] static int off(const Point& from, const Point& to, double share, double shortest_s) noexcept;
  void begin(const Point& first) noexcept;
  void end_quarter();
  void end_second(const Point& newest);
  [[nodiscard]] std::string describe() const;

  bool started_ = false;
  bool judged_ = false;
  bool wrong_ = false;
  std::string fault_;
  Point last_;
  Instant quarter_begin_;
  Point earliest_;                               // of the quarter
  std::array<Point, kQuarters + 1> quarters_{};  // the newest last
  std::size_t seen_ = 0;                         // quarters that have ended
  unsigned quarters_off_ = 0;                    // a bit each, the newest lowest
  int second_off_ = 0;                           // of the last whole one: -1 too slow, 1 too fast
  bool twice_off_ = false;
  Point long_from_;
  int long_before_ = 0;  // of the last such span, as second_off_
  bool long_off_ = false;
  Look now_, second_;  // of the running second, and of the one before
  bool sparse_ = false;
};

}  // namespace perimap
