// How many features may be followed with the computing time that there is, and which ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/pipeline/feature_slot.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What one frame took.
struct FrameTime {
  Duration until_evaluated{0};    // A to C
  bool learning_put_off = false;  // D did not fit before the next frame's budget begins
};

// When to shed and when to take back. A frame overruns when A to C take longer than the budget, or D was put off; it is
// calm when they take less than 60 % of the budget and D was not put off. After 8 overruns within 16 frames an eighth
// of the features that are followed is shed, until 8 are left: with fewer the image tells no phase. After 64 calm
// frames without an overrun between them a sixteenth of all is taken back. Where that was too much, so that features
// are shed again within 256 frames, the next time takes twice as many calm frames, up to 16 times as many. So the
// number settles below what the machine can do, instead of swinging about it. A pure function of the frames' times.
class LoadSheddingDecision {
 public:
  static constexpr int kLeast = 8;
  static constexpr int kWindow = 16;
  static constexpr int kOverruns = 8;
  static constexpr int kCalmFrames = 64;
  static constexpr int kTooSoonFrames = 256;
  static constexpr int kLongestPatience = 16;
  static constexpr double kCalmShare = 0.6;

  LoadSheddingDecision(int maximum, Duration budget) noexcept : maximum_(maximum), limit_(maximum), budget_(budget) {}

  // A frame with so many features followed. True when more have to be shed than before.
  bool add(const FrameTime& frame, int followed) noexcept;

  // So many may be followed.
  [[nodiscard]] int limit() const noexcept { return limit_; }
  [[nodiscard]] int maximum() const noexcept { return maximum_; }

 private:
  void take_back() noexcept;

  int maximum_;
  int limit_;
  Duration budget_;
  std::uint32_t overruns_ = 0;  // of the last kWindow frames, a bit each
  int calm_ = 0;
  int patience_ = 1;
  int since_taken_back_ = kTooSoonFrames;
};

// Marks the slots that are shed. Those that can be seen are kept before those that can not: a feature that is followed
// counts as seen while it is found, but for some frames; one that is shed while the map has it in the image, unless it
// has been followed in vain lately. Of those that count alike, shed first are features that have no map yet, then those
// that have not converged, then the others; within each those that are shed already, then the most uncertain, and of
// two alike the younger. They are ranked anew when the number changes and every kReviewFrames frames, so that two alike
// do not take turns.
//
// A shed feature that has a map goes on being predicted and published from it, and says so; one that has none is soon
// given up, as any that is not found.
// Used by the mapper thread while the workers rest. Nothing is allocated after construction.
class LoadShedding {
 public:
  static constexpr int kReviewFrames = 32;
  // Frames that it is not found in, of those that could have shown it.
  static constexpr int kMissesAllowed = 15;
  // So long one that was followed in vain is no better than one that is not found.
  static constexpr int kSetAsideFrames = 300;

  // The slots must outlive it.
  explicit LoadShedding(std::span<FeatureSlot> slots);

  // After each frame, by its index: which features were found in it. `measurable`: the map could tell where to look.
  void note(std::uint64_t frame_index, bool measurable) noexcept;

  // Sheds and takes back, so that `limit` features are followed, or all if they are fewer. Returns how many are shed.
  std::size_t apply(int limit) noexcept;

  // Features that are followed.
  [[nodiscard]] int followed() const noexcept;
  // Those that can be seen, shed or not.
  [[nodiscard]] int in_sight() const noexcept;

 private:
  struct Watch {
    std::uint32_t id = 0;  // of the feature that the slot had
    int misses = 0;        // in a row, while it is followed
    int set_aside = 0;     // frames left
  };
  struct Ranked {
    FeatureSlot* slot;
    Watch* watch;
    int sight;
  };
  [[nodiscard]] static int sight_of(const FeatureSlot& slot, const Watch& watch) noexcept;
  [[nodiscard]] static bool more_useful(const Ranked& a, const Ranked& b) noexcept;

  std::span<FeatureSlot> slots_;
  std::vector<Watch> watches_;
  std::vector<Ranked> order_;
  int since_ranked_ = 0;  // frames
};

}  // namespace perimap
