// What is wrong with what a frame and its pose are, beside the heart's phase: as the mapper finds it, as the shards
// hand it over, and as a surface tells it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace perimap {

// What displaces all that is found, as far as the patient's reference tool tells.
enum class DisplacedCause : std::uint8_t { kUnknown, kOrgan, kTracker };

struct FrameDoubts {
  bool scope_unread = false;      // how the scope is turned is not known
  bool scope_changed = false;     // it is turned otherwise than at first, and nothing tells what follows
  bool pose_repeated = false;     // the tracker gives one reading again and again, after the camera had moved
  bool picture_repeated = false;  // likewise the camera one picture
  bool still = false;             // the camera has lately been in one place
  bool setup_doubted = false;     // see SetupBelief
  bool displaced = false;         // the organ is not where the map has it, or the tracker errs, see OrganWatch
  DisplacedCause cause = DisplacedCause::kUnknown;
  bool settling = false;  // the map was moved with the organ, and has not converged there since
  bool unproven = false;  // nothing has told since it was out of sight, or moved, that it is where the map has it
  double setup_widening_mm = 0.0;  // what the set-up may put a position off by, RMS of the 3-D norm
  // What a feature's own largest deviation may be for it to be called converged: below the configured bound by what the
  // set-up may be off by; nothing is while no window has told of the set-up.
  double converged_within_mm = std::numeric_limits<double>::infinity();

  // Per axis, by the set-up: in which direction it puts a position off is not known.
  [[nodiscard]] double setup_variance_mm2() const noexcept { return setup_widening_mm * setup_widening_mm / 3.0; }

  // How far a position may be off whose largest deviation over the cycle is this: in the direction of that all may lie
  // that the set-up is off by. It is held to the bound of a feature that has converged.
  [[nodiscard]] double largest_deviation_mm(double of_feature_mm) const noexcept {
    return std::hypot(of_feature_mm, setup_widening_mm);
  }

  // What is doubted in either.
  void add(const FrameDoubts& other) noexcept {
    scope_unread |= other.scope_unread;
    scope_changed |= other.scope_changed;
    pose_repeated |= other.pose_repeated;
    picture_repeated |= other.picture_repeated;
    still |= other.still;
    setup_doubted |= other.setup_doubted;
    if (other.displaced) cause = displaced && cause != other.cause ? DisplacedCause::kUnknown : other.cause;
    displaced |= other.displaced;
    settling |= other.settling;
    unproven |= other.unproven;
    setup_widening_mm = std::max(setup_widening_mm, other.setup_widening_mm);
    converged_within_mm = std::min(converged_within_mm, other.converged_within_mm);
  }
};

}  // namespace perimap
