// How many features may be followed with the computing time that there is, and which ones.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/pipeline/feature_slot.hpp"
#include "core/time/frame_rate.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What one frame took.
struct FrameTime {
  Duration until_evaluated{0};    // A to C
  bool learning_put_off = false;  // D did not fit before the next frame's budget begins
  FrameRate rate;                 // of the frames about then
};

// When to shed and when to take back. A frame overruns when A to C take longer than the budget, or D was put off; it is
// calm when they take less than 60 % of the budget and D was not put off. After 8 overruns within 16 frames an eighth
// of the features that are followed is shed, until 8 are left: with fewer the image tells no phase. After calm
// frames of two seconds in all, without an overrun between them, a sixteenth of all is taken back. Where that was too
// much, so that features are shed again within nine seconds, the next time takes twice as long a calm, up to 16 times
// as long. So the number settles below what the machine can do, instead of swinging about it. Overruns are counted, not
// timed: each is a frame that did not have the time it needed. A pure function of the frames' times.
class LoadSheddingDecision {
 public:
  static constexpr int kLeast = 8;
  static constexpr int kWindow = 16;
  static constexpr int kOverruns = 8;
  static constexpr Duration kCalm = std::chrono::milliseconds(2133);
  static constexpr Duration kTooSoon = std::chrono::milliseconds(8533);
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
  [[nodiscard]] bool is_too_soon(const FrameRate& rate) const noexcept;

  int maximum_;
  int limit_;
  Duration budget_;
  std::uint32_t overruns_ = 0;  // of the last kWindow frames, a bit each
  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t calm_ = 0;  // frames
  int patience_ = 1;
  std::uint64_t since_taken_back_ = kNever;  // frames
};

// Marks the slots that are shed. Those that can be seen are kept before those that can not: a feature that is followed
// counts as seen while it is found, but for some frames; one that is shed while the map has it in the image, unless it
// has been followed in vain lately. Of those that count alike, shed first are features that have no map yet, then those
// that have not converged, then the others; within each those that are shed already, then the most uncertain, and of
// two alike the younger. They are ranked anew when the number changes and every kReview, so that two alike
// do not take turns.
//
// A shed feature that has a map goes on being predicted and published from it, and says so; one that has none is soon
// given up, as any that is not found.
// Used by the mapper thread while the workers rest. Nothing is allocated after construction.
class LoadShedding {
 public:
  static constexpr Duration kReview = std::chrono::milliseconds(1067);
  // That it is not found in, of the frames that could have shown it.
  static constexpr Duration kMissesAllowed = std::chrono::milliseconds(500);
  // So long one that was followed in vain is no better than one that is not found.
  static constexpr Duration kSetAside = std::chrono::seconds(10);

  // The slots must outlive it.
  explicit LoadShedding(std::span<FeatureSlot> slots);

  // After each frame, by its index: which features were found in it. `measurable`: the map could tell where to look.
  void note(std::uint64_t frame_index, bool measurable, const FrameRate& rate) noexcept;

  // Sheds and takes back, so that `limit` features are followed, or all if they are fewer. Returns how many are shed.
  std::size_t apply(int limit) noexcept;

  // Features that are followed.
  [[nodiscard]] int followed() const noexcept;
  // Those that can be seen, shed or not.
  [[nodiscard]] int in_sight() const noexcept;

 private:
  struct Watch {
    std::uint32_t id = 0;         // of the feature that the slot had
    std::uint64_t misses = 0;     // in a row, while it is followed
    std::uint64_t set_aside = 0;  // frames left
  };
  struct Ranked {
    FeatureSlot* slot;
    Watch* watch;
    int sight;
  };
  [[nodiscard]] int sight_of(const FeatureSlot& slot, const Watch& watch) const noexcept;
  [[nodiscard]] static bool more_useful(const Ranked& a, const Ranked& b) noexcept;

  std::span<FeatureSlot> slots_;
  std::vector<Watch> watches_;
  std::vector<Ranked> order_;
  FrameRate rate_;                  // of the last frame
  std::uint64_t since_ranked_ = 0;  // frames
};

}  // namespace perimap
