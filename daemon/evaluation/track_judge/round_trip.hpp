// What can be told of tracks without any truth: a clip that is played there and back must bring each of them back to
// where it began.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "daemon/evaluation/track_judge/tracks.hpp"

namespace perimap {

enum class TripVerdict : std::uint8_t {
  kLost,       // not there in the last frame
  kRight,      // there, where it began, and at the turn where the other tracker has it
  kElsewhere,  // there, but not where it began
  kStrayed,    // there, where it began, but at the turn not where the other tracker, started from it, has it
};

struct TripLimits {
  // At 1280 pixels of width; scaled to others.
  double back_px = 3;
  double off_px = 5;
  double turn_px = 5;
  // From one of its places to the next, in the picture's own pixels: a heart in a picture of 360 moves by 20 in a
  // frame.
  double jump_px = 60;
  static constexpr std::size_t kFirstFrames = 3;  // begun in one of these
};

struct TripFigures {
  std::size_t begun = 0, alive = 0, right = 0;
  std::size_t off = 0;    // alive and more than off_px from where it began
  std::size_t jumps = 0;  // of all tracks
  double median_px = 0;   // from where it began, of those alive; in the clip's own pixels
  std::map<std::uint32_t, TripVerdict> verdicts;
};

// The first frame in which the track is, if that is one of the first.
[[nodiscard]] std::optional<std::size_t> begin_of(const Track& track);

// `reference` has each feature at the turn, where the other tracker still has it there; the others are judged by their
// return alone. A track has 2 turn + 1 places.
[[nodiscard]] TripFigures judge_round_trip(const Tracks& tracks, std::size_t turn, int width,
                                           const std::map<std::uint32_t, Vector2d>& reference,
                                           const TripLimits& limits = {});

}  // namespace perimap
