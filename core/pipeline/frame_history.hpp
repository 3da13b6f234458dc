// What all features share about each of the last frames: pose, phases and basis at capture.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>

#include "core/geometry/pixel_map.hpp"
#include "core/periodic/basis.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/pipeline/phase_basis.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/measured_frame_rate.hpp"
#include "core/time/frame_rate.hpp"

namespace perimap {

struct FrameRecord {
  std::uint64_t index = 0;  // the mapper's own count, without gaps
  FrameStamp stamp;
  bool repeated = false;          // the picture is the one before bit for bit
  bool measurable = false;        // pose, phase and a picture of its own are there, so its matches can be learnt from
  bool held = false;              // and are, where the camera is no faster than what is learnt
  std::uint64_t held_number = 0;  // of those that are held, up to this one
  FrameRate rate;                 // of the frames, as known by then
  FrameRate held_rate;            // of those that are held
  CameraPose pose;  // what is not known of the breathing counts as noise of its position: either moves all alike
  Pose X_CW;
  // Where the picture has what the camera's model has elsewhere, as the scope is turned and zoomed. Pixels that are
  // held for learning, and those of CommonMatch, are the model's; all others are the picture's.
  PixelMap picture;
  double tracker_variance_mm2 = 0.0;  // of the position, per axis, the tracker's part alone
  RespiratoryPhase respiration;       // at capture, as known at the last refresh
  // How the whole surface is displaced from where the map has it, going by the frames before; for the search alone.
  Vector3d displacement_mm = Vector3d::Zero();
  double displacement_deviation_mm = 0.0;  // per axis
  // So much farther around that its features are searched for, per axis; what is found there agrees no better with it.
  double search_deviation_mm = 0.0;
  PhaseEstimate phase;  // at capture, as known at the last refresh
  CardiacCycle cycle;   // that the capture lies in, once the phase is exact
  Basis b;
  Basis b_rate;
};

// Owns the measured frame rate: what lasts is counted in frames that are mapped, or in frames that are held, by the
// record's own rates. Written by the mapper while no stage runs, read by the workers during stages.
class FrameHistory {
 public:
  static constexpr std::uint64_t kHeld = 256;       // frames that are learnt from
  static constexpr std::uint64_t kCapacity = 1024;  // with those between, to 280 frames a second
  // Between two that are learnt from, so that the slowest heart's cycle is there until it has ended. More a second
  // would tell little more, for errors of the R peaks are common to a cycle's matches.
  static constexpr Duration kHeldEvery = std::chrono::milliseconds(14);

  explicit FrameHistory(const BasisLayout& layout) noexcept : layout_(layout) {}

  FrameRecord& append(const FrameStamp& stamp) noexcept {
    FrameRecord& record = records_[count_ % kCapacity];
    record = FrameRecord{};
    record.index = count_++;
    record.stamp = stamp;
    record.held = held_ == 0 || stamp.capture < last_held_ || stamp.capture - last_held_ >= kHeldEvery;
    rate_.add(stamp.capture);
    if (record.held) {
      held_rate_.add(stamp.capture);
      last_held_ = stamp.capture;
      ++held_;
      ++held_ever_;
    }
    record.held_number = held_ever_;
    record.rate = rate_.rate();
    record.held_rate = held_rate_.rate();
    while (held_ > kHeld || count_ - oldest_ > kCapacity) held_ -= records_[oldest_++ % kCapacity].held ? 1 : 0;
    return record;
  }

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

  // Null before the first frame.
  [[nodiscard]] const FrameRecord* newest() const noexcept {
    return count_ == 0 ? nullptr : &records_[(count_ - 1) % kCapacity];
  }

  // Index of the oldest frame captured at t or later; count() where there is none.
  [[nodiscard]] std::uint64_t first_since(Instant t) const noexcept {
    std::uint64_t index = count_;
    while (index > oldest_ && records_[(index - 1) % kCapacity].stamp.capture >= t) --index;
    return index;
  }

  [[nodiscard]] Duration span() const noexcept {
    if (count_ == 0) return Duration(0);
    return records_[(count_ - 1) % kCapacity].stamp.capture - records_[oldest_ % kCapacity].stamp.capture;
  }

  // Null when the frame has left the history.
  [[nodiscard]] const FrameRecord* find(std::uint64_t index) const noexcept {
    if (index >= count_ || index < oldest_) return nullptr;
    return &records_[index % kCapacity];
  }

  static void set_pose(FrameRecord& record, const CameraPose& pose) noexcept {
    record.pose = pose;
    record.tracker_variance_mm2 = pose.position_variance_mm2;
    if (pose.valid()) record.X_CW = pose.X_WC.inverse();
  }

  // The poses of the frames from this one on were told by a set-up that did not hold: nothing more is learnt from them.
  void disown_poses(std::uint64_t from_index) noexcept {
    for (std::uint64_t i = std::max(from_index, oldest_); i < count_; ++i) {
      FrameRecord& record = records_[i % kCapacity];
      record.pose.state = CameraPose::State::kMissing;
      record.measurable = false;
    }
  }

  // Fills phases and basis of a new record, whose pose is set, from the clocks. The basis is computed here, once a
  // frame. Whatever the clock knows, the next beat's refresh is the first to tell the phase as exact: the frames before
  // were told by another clock where the last cycle ended, and one of them may be open yet.
  void set_phase(FrameRecord& record, const CardiacClock& clock, const RespiratoryClock& respiration) noexcept {
    set_respiration(record, respiration);
    set_cardiac_phase(record, clock);
    record.phase.exact = false;
  }

  // After a beat: the frames whose cycle was still open get what is known now. At most a cycle or two of frames.
  void refresh_phases(const CardiacClock& clock, const RespiratoryClock& respiration) noexcept {
    for (std::uint64_t i = count_; i > oldest_; --i) {
      FrameRecord& record = records_[(i - 1) % kCapacity];
      if (record.phase.exact) return;
      set_respiration(record, respiration);
      set_cardiac_phase(record, clock);
    }
  }

  // After breathing has been found in them: what is known of it now counts for all frames.
  void retell_respiration(const RespiratoryClock& respiration) noexcept {
    for (std::uint64_t i = oldest_; i < count_; ++i) {
      FrameRecord& record = records_[i % kCapacity];
      set_respiration(record, respiration);
      record.b = basis_at(layout_, record.phase.phase_rad, record.respiration);
    }
  }

  // After another law has been taken: all frames of completed cycles, which nothing else changes any more.
  void retell_phases(const CardiacClock& clock) noexcept {
    for (std::uint64_t i = oldest_; i < count_; ++i) {
      FrameRecord& record = records_[i % kCapacity];
      if (record.phase.exact) set_cardiac_phase(record, clock);
    }
  }

 private:
  static void set_respiration(FrameRecord& record, const RespiratoryClock& respiration) noexcept {
    record.respiration = respiration.at(record.stamp.capture);
    record.pose.position_variance_mm2 =
        record.tracker_variance_mm2 + record.respiration.deviation_mm * record.respiration.deviation_mm;
  }

  void set_cardiac_phase(FrameRecord& record, const CardiacClock& clock) const noexcept {
    record.phase = clock.at(record.stamp.capture);
    if (record.phase.exact) record.cycle = clock.cycle_at(record.stamp.capture);
    record.measurable = record.pose.valid() && usable(record.phase.state) && !record.repeated;
    record.b = basis_at(layout_, record.phase.phase_rad, record.respiration);
    record.b_rate = basis_rate(layout_, record.phase.phase_rad);
  }

  BasisLayout layout_;
  std::array<FrameRecord, kCapacity> records_{};
  std::uint64_t count_ = 0;
  std::uint64_t oldest_ = 0;  // index of the oldest that is still there; count_ when there is none
  std::uint64_t held_ = 0;    // of those that are there
  std::uint64_t held_ever_ = 0;
  MeasuredFrameRate rate_;       // of the frames that are mapped
  MeasuredFrameRate held_rate_;  // of those that are learnt from
  Instant last_held_;
};

}  // namespace perimap
