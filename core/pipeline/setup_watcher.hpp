// Housekeeping: the set-up is judged by the session's own matches, on a thread of its own, so that what comes of it can
// be adopted at a stated frame.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/match_window.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/realtime/background_round.hpp"
#include "core/realtime/triple_buffer.hpp"
#include "core/setup_watch/setup_belief.hpp"
#include "core/setup_watch/setup_memory.hpp"
#include "core/setup_watch/watched_window.hpp"

namespace perimap {

// A round: the features that have most matches in the window are copied here with them, judged, and the verdict is
// adopted a stated number of frames after the round began; where it is not there by then, at the first frame that has
// it, but never so in lockstep. One round at a time. keep(), adopt() and what voids frames belong to the mapper,
// serve() to the housekeeping thread.
class SetupWatcher {
 public:
  static constexpr std::size_t kFeatures = 12;  // of a round: the time that it takes grows with their cube

  explicit SetupWatcher(const PipelineSettings& settings);

  // Mapper, once a frame, when its matches are believed and no worker learns: keeps them, and begins a round when one
  // is due.
  void keep(const FrameHistory& history, std::span<const FeatureSlot> slots, const MapBank& bank) noexcept;
  // Mapper, once a frame before that: what a round has come to, at the frame stated when it began.
  void adopt(const FrameRecord& frame) noexcept;
  // Mapper, before adopt(): the phases of completed cycles are told by another law, or breathing otherwise. What is
  // being judged was told by the old ones and counts for nothing.
  void retell_phases(const CardiacClock& clock) noexcept;
  void retell_respiration(const RespiratoryClock& respiration) noexcept;
  // Before the first frame: the set-up is that of an earlier run, and is believed as it was in that.
  void recall(const SetupMemory& memory) noexcept;
  // Mapper: another patient. What is believed of the set-up stays.
  void begin_window_anew() noexcept;
  // Poses from that frame on were mistaken.
  void disown_poses(std::uint64_t since_frame) noexcept;

  // Mapper: what is believed as of the last adopt().
  [[nodiscard]] const SetupBelief& belief() const noexcept { return belief_; }
  // Mapper: the same as a frame's doubts have it. `bound_mm`: on a converged feature's largest deviation.
  void tell(FrameDoubts& doubts, double bound_mm) const noexcept;
  // Status thread: the same, valid until the next call.
  [[nodiscard]] const SetupBelief& status_belief() noexcept;

  // Until dismiss().
  void serve() noexcept;
  void dismiss() noexcept;

 private:
  struct Round {
    std::array<WindowFrame, MatchWindow::kFrames> frames;
    std::array<std::array<WindowMatch, kFeatures>, MatchWindow::kFrames> matches;  // slot: the feature's number
    std::array<std::size_t, MatchWindow::kFrames> counts{};
    std::array<StateVector, kFeatures> x;
    FrameRate rate;  // of the camera
    std::size_t frame_count = 0;
    std::size_t feature_count = 0;
  };

  static constexpr std::size_t kNotChosen = kFeatures;
  struct Seen {
    std::uint32_t id = 0;
    std::size_t matches = 0;
    std::size_t number = kNotChosen;  // in a round
  };

  [[nodiscard]] bool choose_features(std::span<const FeatureSlot> slots) noexcept;
  void copy_window(const MapBank& bank, const FrameRate& rate) noexcept;
  void judge() noexcept;

  CameraModel camera_;
  BasisLayout layout_;
  Prior motion_;
  double pixel_deviation_px_;
  double error_correlation_s_;
  BackgroundRound hand_over_;  // of a round

  // The mapper's own.
  MatchWindow window_;
  SetupBelief belief_;
  TripleBuffer<SetupBelief> status_;
  std::optional<Instant> first_capture_;
  std::vector<Seen> seen_;           // by slot
  std::vector<std::size_t> chosen_;  // slots
  bool discarded_ = false;           // the round that is under way
  std::uint64_t judged_frame_ = 0;   // the newest that the last round knew all of
  std::uint64_t adopted_at_ = 0;
  std::uint64_t next_round_at_ = 0;

  // Handed over: housekeeping's while a round is under way.
  std::unique_ptr<Round> round_;
  SetupVerdict verdict_;
};

}  // namespace perimap
