// The last seconds of matches, for the watch over the set-up: some twenty frames a second, with what all features share
// about each as it is known once the frame's cycle has ended.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/setup_watch/setup_deviation.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct WindowMatch {
  std::size_t slot = 0;
  std::uint32_t id = 0;  // of the feature that was in it
  Vector2d px = Vector2d::Zero();
  Matrix2d covariance_px2 = Matrix2d::Identity();
};

struct WindowFrame {
  enum class State : std::uint8_t {
    kOpen,    // its cycle has not ended yet
    kTold,    // the rest of it is there
    kUseless  // it left the history, or belongs to a cycle that does not teach
  };
  State state = State::kOpen;
  std::uint64_t index = 0;
  Instant capture;
  Pose X_WC;
  CameraTwist twist;
  Vector3d lever_W_mm = Vector3d::Zero();
  double tracker_variance_mm2 = 0.0;  // of the position, per axis
  double rotation_variance_rad2 = 0.0;
  PhaseEstimate phase;
  RespiratoryPhase respiration;
};

// Written by the mapper thread while the workers are at rest. Nothing is allocated after construction.
class MatchWindow {
 public:
  static constexpr std::size_t kFrames = 400;
  static constexpr Duration kEvery = std::chrono::milliseconds(50);
  static constexpr Duration kLength = std::chrono::seconds(20);

  explicit MatchWindow(std::size_t slots) : matches_(kFrames * slots), slots_(slots) {}

  // This frame's matches of all features that are followed, if it is time for another frame's: most of those that are
  // mapped when the window is judged were followed before.
  void add(const FrameRecord& frame, std::span<const FeatureSlot> slots) noexcept;
  // Frames whose cycles have ended get what is known of them now; those that are too old go.
  void tell(const FrameHistory& history) noexcept;
  // Poses from that frame on were mistaken.
  void disown(std::uint64_t since_frame) noexcept;
  // As FrameHistory does with its frames.
  void retell_phases(const CardiacClock& clock) noexcept;
  void retell_respiration(const RespiratoryClock& respiration) noexcept;
  void clear() noexcept { begin_ = end_; }

  // Numbers of the frames that are there, oldest first.
  [[nodiscard]] std::uint64_t begin() const noexcept { return begin_; }
  [[nodiscard]] std::uint64_t end() const noexcept { return end_; }
  // How many of them are told.
  [[nodiscard]] std::size_t told() const noexcept;
  // Index of the newest frame of which all is known; none: 0.
  [[nodiscard]] std::uint64_t newest_told() const noexcept;
  [[nodiscard]] const WindowFrame& frame(std::uint64_t number) const noexcept { return frames_[number % kFrames]; }
  [[nodiscard]] std::span<const WindowMatch> matches(std::uint64_t number) const noexcept {
    return {matches_.data() + (number % kFrames) * slots_, counts_[number % kFrames]};
  }

 private:
  std::array<WindowFrame, kFrames> frames_{};
  std::array<std::size_t, kFrames> counts_{};
  std::vector<WindowMatch> matches_;  // `slots_` a frame
  std::size_t slots_;
  std::uint64_t begin_ = 0;
  std::uint64_t end_ = 0;
  Instant due_;  // the next frame
};

// How fast the camera moves at a frame of the history, by a straight line through the poses of the frames about it: a
// noisy tracker's two neighbouring poses would tell hardly anything.
[[nodiscard]] CameraTwist camera_twist(const FrameHistory& history, const FrameRecord& frame) noexcept;

}  // namespace perimap
