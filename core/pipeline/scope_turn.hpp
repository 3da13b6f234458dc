// How far an angled scope is turned in its camera head, frame by frame, by its field stop's notch; and the set-up then.
#pragma once

#include <cstdint>
#include <optional>

#include "core/calibration/field_stop.hpp"
#include "core/calibration/notch_arc.hpp"
#include "core/calibration/turned_scope.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/geometry/pixel_map.hpp"

namespace perimap {

// The camera in the sensor's frame, and where the picture has what the calibrated lens has elsewhere.
struct ScopeState {
  Pose X_SC;
  PixelMap picture;
  double rotation_rad = 0.0;
  double rotation_deviation_rad = 0.0;
};

// Whole readings of a picture now and then tell the circle and about where the notch is; each frame tells by itself
// where it is exactly. A frame in which no notch is read has no state, and the first one that tells another turn than
// the frames before has none either: the next one must agree with it. A scope that is held is known by the mean of its
// last frames, and that no better than a third of one, for they have errors in common. No heap after construction.
class ScopeTurn {
 public:
  // `lens`: as calibrated.
  ScopeTurn(const TurnedScope& scope, const CameraModel& lens) : scope_(scope), lens_(lens) {}

  // Of a picture some frames ago, in which take() was given `seen_then`. True when what was seen then was another
  // thing: the frames since were told a wrong turn.
  bool adopt(const FieldStopReading& reading, const std::optional<NotchReading>& seen_then) noexcept;
  // No whole reading for so long that the circle is not to be trusted any more.
  void give_up() noexcept;

  // One frame's picture, or what was read in it: none where no notch was.
  void look(const GreyImage& picture) noexcept;
  void take(const std::optional<NotchReading>& reading) noexcept;

  // Of the frame that was taken last.
  [[nodiscard]] const std::optional<ScopeState>& state() const noexcept { return state_; }
  [[nodiscard]] const std::optional<NotchReading>& seen() const noexcept { return seen_; }
  // How often it was known to be turned or zoomed otherwise than before.
  [[nodiscard]] std::uint64_t turns() const noexcept { return turns_; }

  [[nodiscard]] static bool agree(const NotchReading& a, const NotchReading& b) noexcept;

 private:
  void settle(const NotchReading& reading, double readings) noexcept;
  void set_circle(const FieldStopReading& reading) noexcept;
  void follow_circle(const FieldStopReading& reading) noexcept;

  struct Known {
    double rotation_rad = 0.0;
    double radius_px = 0.0;
  };

  TurnedScope scope_;
  CameraModel lens_;
  std::optional<FieldStopReading> stop_;  // none: its circle is not known
  double circles_ = 0.0;                  // whole readings in it
  double near_rad_ = 0.0;                 // where the notch is looked for
  std::optional<NotchReading> seen_;
  std::optional<NotchReading> candidate_;  // that nothing has agreed with yet
  NotchReading held_;
  double readings_ = 0.0;  // in held_; 0: it means nothing
  std::optional<ScopeState> state_;
  std::optional<Known> known_;  // last
  std::uint64_t turns_ = 0;
};

}  // namespace perimap
