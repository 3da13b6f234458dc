// How far an angled scope is turned in its camera head, frame by frame, by its field stop's notch; and the set-up then.
#pragma once

#include <cstdint>
#include <optional>

#include "core/calibration/field_stop.hpp"
#include "core/calibration/notch_arc.hpp"
#include "core/pipeline/held_turn.hpp"
#include "core/pipeline/scope_state.hpp"

namespace perimap {

// Whole readings of a picture now and then tell the circle and about where the notch is; each frame tells by itself
// where it is exactly. A frame in which no notch is read has no state, and neither has the first one that tells another
// turn than the frames before (HeldTurn). No heap after construction.
class ScopeTurn {
 public:
  // `lens`: as calibrated.
  ScopeTurn(const TurnedScope& scope, const CameraModel& lens) : states_(scope, lens) {}

  // Of a picture some frames ago, in which follow() was given `seen_then`. True when what was seen then was another
  // thing: the frames since were told a wrong turn.
  bool adopt(const FieldStopReading& reading, const std::optional<TurnReading>& seen_then) noexcept;
  // No whole reading for so long that the circle is not to be trusted any more.
  void give_up() noexcept;

  // One frame's picture, or what was read in it: none where no notch was.
  void look(const GreyImage& picture) noexcept;
  void follow(const std::optional<TurnReading>& reading) noexcept;

  // Of the frame that was followed last.
  [[nodiscard]] const std::optional<ScopeState>& state() const noexcept { return state_; }
  [[nodiscard]] const std::optional<TurnReading>& seen() const noexcept { return seen_; }
  // How often it was known to be turned or zoomed otherwise than before.
  [[nodiscard]] std::uint64_t turns() const noexcept { return states_.turns(); }

 private:
  void set_circle(const FieldStopReading& reading) noexcept;
  void follow_circle(const FieldStopReading& reading) noexcept;

  // Of pictures of one field stop: no better than a third of one.
  static constexpr double kCommonShare = 1.0 / 3.0;

  ScopeStates states_;
  std::optional<FieldStopReading> stop_;  // none: its circle is not known
  double circles_ = 0.0;                  // whole readings in it
  double near_rad_ = 0.0;                 // where the notch is looked for
  std::optional<TurnReading> seen_;
  HeldTurn held_{kCommonShare};
  std::optional<ScopeState> state_;
};

}  // namespace perimap
