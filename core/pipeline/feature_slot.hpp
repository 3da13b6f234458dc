// One feature's whole life in the pipeline but its estimate, which the bank holds; in memory that is there from the
// start.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/estimation/batch_start.hpp"
#include "core/estimation/correlated_pose_noise.hpp"
#include "core/estimation/feature_health.hpp"
#include "core/estimation/local_displacement.hpp"
#include "core/estimation/observation.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/law_trial.hpp"
#include "core/phase/phase_law.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/parallax.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/pipeline/repeated_errors.hpp"
#include "core/surface/surface_start.hpp"
#include "core/time/frame_rate.hpp"
#include "core/time/instant.hpp"
#include "core/vision/last_view.hpp"
#include "core/vision/patch_continuity.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// Time without a match after which the image alone no longer tells where a feature is: by its last place, and carried
// along with the features around it.
inline constexpr Duration kTrackedUnseen = std::chrono::milliseconds(167);
inline constexpr Duration kCarriedUnseen = std::chrono::milliseconds(500);
// Before this frame, at any rate longer than that: what was found then tells nothing any more. The difference of the
// counts is what matters, and wraps.
inline constexpr std::uint64_t kFramesLongAgo = std::uint64_t{1} << 32U;

// A start's matches are about so far apart where the camera is faster: they span as long at every rate.
inline constexpr Duration kStartMatchesEvery = std::chrono::microseconds(33333);
[[nodiscard]] inline FrameRate rate_of_starts(const FrameRate& held_rate) noexcept {
  return FrameRate(held_rate.per_s() / static_cast<double>(held_rate.frames(kStartMatchesEvery)));
}

enum class SlotState : std::uint8_t {
  kEmpty,
  kTracked,   // followed in the image, gathering the observations of its start
  kStarting,  // the batch start is under way in housekeeping
  kMapped     // has an estimate in the bank
};

// A match that waits to be learnt. Its pose and phase are in the frame history.
struct HeldMatch {
  std::uint64_t frame_index = 0;
  Vector2d px = Vector2d::Zero();
  Matrix2d covariance_px2 = Matrix2d::Identity();
};

// The matches of one feature that are not learnt yet, oldest first. When it is full the oldest goes.
class HeldMatches {
 public:
  void clear() noexcept { head_ = tail_ = 0; }
  [[nodiscard]] std::uint32_t size() const noexcept { return head_ - tail_; }
  [[nodiscard]] const HeldMatch& operator[](std::uint32_t i) const noexcept {
    return matches_[(tail_ + i) % kCapacity];
  }
  void push(const HeldMatch& match) noexcept {
    if (size() == kCapacity) ++tail_;
    matches_[head_++ % kCapacity] = match;
  }
  void drop(std::uint32_t n) noexcept { tail_ += n < size() ? n : size(); }
  // All that was dropped is held again, as far back as it has not been written over.
  void take_back() noexcept {
    const auto frame = [this](std::uint32_t i) { return matches_[i % kCapacity].frame_index; };
    while (tail_ > 0 && size() < kCapacity && (size() == 0 || frame(tail_ - 1) < frame(tail_))) --tail_;
  }
  template <class Condition>
  void drop_if(Condition condition) noexcept {
    std::uint32_t kept = tail_;
    for (std::uint32_t i = tail_; i != head_; ++i) {
      if (!condition(matches_[i % kCapacity])) matches_[kept++ % kCapacity] = matches_[i % kCapacity];
    }
    head_ = kept;
  }

 private:
  static constexpr std::uint32_t kCapacity = 256;  // a power of two, so that the indices may wrap
  std::array<HeldMatch, kCapacity> matches_{};
  std::uint32_t head_ = 0;
  std::uint32_t tail_ = 0;
};

// What other laws make of an observation's basis.
struct ObservedCycle {
  CardiacCycle cycle;
  RespiratoryPhase respiration;
};

enum class StartAsked : std::uint8_t {
  kAlone,            // by its own matches, all that a start takes
  kOnSurface,        // by few, on the surface that the others have made, or not at all
  kOnSurfaceOrAlone  // by all that a start takes: on the surface, or where it is not of that, alone
};

// The hand-over to housekeeping and back: the worker fills `observations`, raises `requested` through its ring, and
// does not touch the rest before `ready`.
struct BatchStartExchange {
  std::array<Observation, kMaxStartObservations> observations{};
  std::array<Instant, kMaxStartObservations> captures{};
  std::array<CameraPose, kMaxStartObservations> poses{};  // with their noise
  std::array<ObservedCycle, kMaxStartObservations> cycles{};
  RepeatedErrors repeated;  // of the observations
  LawBelief law;            // by which the observations have their bases
  int count = 0;
  StartAsked asked = StartAsked::kAlone;
  std::uint64_t adopt_at_frame = 0;
  BatchOutcome outcome;
  SurfaceStartKind on_surface = SurfaceStartKind::kNotThere;  // what came of that, where it was asked
  std::optional<LawTrial> trial;                              // where more than one law was possible
  // Housekeeping stores true with release after writing what comes of it; the mapper's acquire load then sees all
  // of it, and so does a worker, whose stage begins after that.
  std::atomic<bool> ready{false};
  bool due = false;  // the mapper has seen it ready at the frame of its adoption, or later
};

// What the match that was found in a frame is off by, beside the pose and the phase that the frame's matches agree on,
// before it is judged by them.
struct BesideMatch {
  bool told = false;
  std::uint64_t frame_index = 0;
  Vector2d r = Vector2d::Zero();       // px
  Matrix23d J = Matrix23d::Zero();     // d px / d p_W, px/mm
  Matrix2d R = Matrix2d::Identity();   // px^2, of the match
  Vector3d p_W_mm = Vector3d::Zero();  // where the map has it
  Matrix3d S = Matrix3d::Zero();       // mm^2, of the map there
};

// A feature as it is followed in the images. Another one is another value.
struct TrackedFeature {
  std::uint32_t id = 0;
  Instant first_observed;
  Vector2d first_observed_px = Vector2d::Zero();

  bool shed = false;    // not looked for, so that the frame's time suffices for the others; see LoadShedding
  bool in_view = true;  // the map has it in the image, when it could tell last

  PatchTemplate patch{};
  PatchState patch_state{};        // when it was found last
  PatchState seen{};               // of this frame's match, until that is believed
  bool seen_by_last_view = false;  // likewise: the first view fits nowhere
  LastView last_view{};
  Vector2d carried_px = Vector2d::Zero();  // patch_state.px, moved since then with the features around it
  PatchContinuity looks{};
  Vector2d velocity_px = Vector2d::Zero();  // per frame
  std::uint64_t last_found_frame = 0;
  std::uint64_t last_told_frame = 0;   // likewise, and its place was told well enough to be learnt from
  std::uint64_t stale_matches = 0;     // in a row, of a template that fits the view badly
  PatchMatch match{};                  // of this frame
  bool match_agrees = false;           // it lies where the map predicted it
  bool is_scout = false;               // of this frame: see scouts.hpp
  Vector2d off_px = Vector2d::Zero();  // the last match of stage A, from where map and tracker have it
  double pose_deviation_px = 0.0;      // largest, of what pose and model add to that prediction; 0 without a map
};

// What waits to be learnt from; and what came of it as long as there is no estimate.
struct GatheredMatches {
  HeldMatches held{};
  int failed_starts = 0;
  bool surface_asked = false;  // and has told nothing of it: next time with all matches that a start takes
  bool starts_alone = false;   // its matches have contradicted the surface, or the estimate that began on it
};

// What is known of a feature's estimate. Another estimate is another value.
struct MappedFeature {
  FeatureHealth health{};
  Instant last_observed;         // found where the map has it
  Instant last_learnt;           // capture time of the last update, for process noise
  double last_learnt_rad = 0.0;  // its phase
  int updates = 0;
  SeenFromAside aside{};      // of all that the estimate was made from
  RepeatedErrors repeated{};  // likewise
  double largest_deviation_mm = 0.0;
  bool began_on_surface = false;
  bool converged = false;
  bool recalled_converged = false;      // it was before a restart: believed until the innovations tell
  std::uint64_t unseen_frames = 0;      // since its place was told, in which it could have been
  std::uint64_t refused_in_a_row = 0;   // matches, found, but at learning the estimate's gate said no
  bool follows_something_else = false;  // refused so often that the patch must be let go

  BesideMatch beside{};
  // See PatchWatch: what the last moments tell of its being off the map, up to then; where the map had it; and whether
  // it lies in a patch that is displaced while the rest of the surface is not, and since when.
  OffMap off_map{};
  Instant off_map_at{};
  Vector3d place_W_mm = Vector3d::Zero();
  bool placed = false;
  bool pressed = false;
  Instant pressed_since{};
};

// What a slot knows of its feature is in the three values, and the slot passes from one state to the next by assigning
// them whole: what one of them comes to hold later can not be left behind by the feature before.
struct FeatureSlot : TrackedFeature, GatheredMatches, MappedFeature {
  SlotState state = SlotState::kEmpty;
  bool forgotten = false;  // while starting: to be emptied when housekeeping has given the start back

  // These two are housekeeping's while the batch start is under way, and no part of what is assigned.
  BatchStartExchange start;
  // What a slow error of the tracker adds to the estimate's covariance; null where that error is white. The batch start
  // begins it.
  std::unique_ptr<CorrelatedPoseNoise> slow_error;

  // Not while a batch start is under way.
  void clear() noexcept {
    follow({});
    state = SlotState::kEmpty;
  }
  void follow(const TrackedFeature& feature) noexcept {
    static_cast<TrackedFeature&>(*this) = feature;
    gather_anew();
    forgotten = false;
  }
  // The feature is followed on, and of its estimate and what that was learnt from nothing is kept.
  void gather_anew() noexcept {
    static_cast<GatheredMatches&>(*this) = {};
    static_cast<MappedFeature&>(*this) = {};
    state = SlotState::kTracked;
  }
  // The bank has an estimate of it.
  void map(const MappedFeature& feature) noexcept {
    static_cast<MappedFeature&>(*this) = feature;
    state = SlotState::kMapped;
  }
};

}  // namespace perimap
