// What the mapper believes of breathing, and how far the map has followed it.
//
//            lock                              images have told its rate
//   young ─────────▶ begun (the map has a ─────────────────────────────▶ corrected: the map has learnt by the rate that
//     ▲   ◀───────── wave of breathing)                                  the images told, and nothing is learnt anew
//     │    lost, and found again: begun anew, what was learnt meanwhile   because of breathing any more
//     └─ a recalled map with breathing in it begins as corrected, one without it as young
//
// Until its phase is known breathing displaces the whole surface by something that is not known: the frames' poses are
// reckoned as uncertain as that, and features are searched for where that displacement was seen last.
#pragma once

#include "core/geometry/pose.hpp"
#include "core/phase/breath_detector.hpp"
#include "core/phase/image_phase_answer.hpp"
#include "core/phase/respiration_memory.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/phase/respiratory_tracker.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// The tracker errs so little that it pays to learn the frames of the history once more when what is known of their
// breathing has changed: beyond, a map is no better for it, by measurement (docs/evidence). False without a frame.
[[nodiscard]] bool pays_to_learn_again(const FrameHistory& history) noexcept;

// All members are called by the mapper thread; none allocates. Another patient is another Breathing.
class Breathing {
 public:
  // What has changed since the frame before, in the order in which history and map are to follow.
  struct Change {
    bool told_anew = false;     // all frames of the history, by clock()
    bool lost_before = false;   // what the map learnt by the phase before this one is doubtful
    bool begun = false;         // the mapped features take wave() as a start
    bool begun_again = false;   // ... and learn the frames of the history once more
    bool learnt_again = false;  // they learn them once more, by the rate that the images have corrected

    // The map's own phase changes with it.
    [[nodiscard]] bool map_changes() const noexcept { return begun || learnt_again; }
  };

  explicit Breathing(const RespirationSettings& settings) noexcept : settings_(settings), tracker_(settings) {}

  // Before a frame: what the respiration channel told until its capture, or later.
  void hear(const BreathSignal& signal, Instant capture) noexcept { tracker_.track_signal(signal, capture); }
  // Before a frame is appended to the history.
  Change begin_frame(const FrameHistory& history) noexcept;
  // While breathing is not known the surface of this frame is expected displaced as it was seen last.
  void expect_displacement(FrameRecord& frame) const noexcept;

  // B: what the frame's features show of its phase, where that is known. Whether they have told anything of it, be it
  // that they contradict.
  bool observe(const ImagePhaseAnswer& seen, Instant capture) noexcept;
  // Whether this frame is to tell how the whole surface is displaced.
  [[nodiscard]] bool asks_for_displacement(const FrameRecord& frame, bool phase_told) const noexcept;
  // By so much (mm, frame W) from where the map has it.
  void add_displacement(const FrameRecord& frame, const Vector3d& displacement_mm) noexcept;

  // D, once a frame: now and then it looks for breathing, which takes some milliseconds, beside the workers.
  void search(const FrameRecord& frame) noexcept;

  // Of the frame history: what is published says that it is corrected only when the map has followed.
  [[nodiscard]] const RespiratoryClock& clock() const noexcept { return tracker_.clock(); }
  [[nodiscard]] RespiratoryClock published() const noexcept;
  [[nodiscard]] const BreathWave& wave() const noexcept { return tracker_.wave(); }
  // The mapped features have breathing in them.
  [[nodiscard]] bool begun() const noexcept { return begun_; }

  // What outlives a crash, and going on from it before the first frame.
  [[nodiscard]] RespirationMemory memory() const noexcept { return tracker_.memory(); }
  void recall(const RespirationMemory& memory, Instant now) noexcept;

 private:
  RespirationSettings settings_;
  RespiratoryTracker tracker_;
  RespirationState told_ = RespirationState::kOff;  // that the frame history tells of, until it is corrected
  bool begun_ = false;
  bool corrected_ = false;
  bool displaced_ = false;  // of what follows
  Vector3d displacement_mm_ = Vector3d::Zero();
  Instant displacement_time_;
};

}  // namespace perimap
