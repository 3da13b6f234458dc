// The phases that the images have shown lately, for whoever has to weigh them once more when a beat becomes known.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/angle/angle.hpp"
#include "core/phase/observed_phase.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// At any frame rate it reaches back Capacity times kEvery at least: what is seen within that time of what is kept is
// joined with it, by precision, to one phase at one instant. So no more is weighed, however fast the camera, and
// nothing that was seen is lost. (Over so short a time the phase runs evenly.) No heap, no locks.
template <std::size_t Capacity>
class KeptPhases {
 public:
  // As FrameHistory::kHeldEvery: up to 71 frames/s each is kept as it is.
  static constexpr Duration kEvery = std::chrono::milliseconds(14);

  void add(const ObservedPhase& observed) noexcept {
    newest_ = observed;
    if (joins(observed)) {
      join(kept_[(count_ - 1) % Capacity], observed);
      return;
    }
    kept_[count_++ % Capacity] = observed;
    first_ = observed.time;
  }

  [[nodiscard]] std::size_t size() const noexcept {
    return static_cast<std::size_t>(std::min<std::uint64_t>(count_, Capacity));
  }
  // Oldest first.
  [[nodiscard]] const ObservedPhase& operator[](std::size_t i) const noexcept {
    return kept_[(count_ - size() + i) % Capacity];
  }
  // The last one as it was added. There must be one.
  [[nodiscard]] const ObservedPhase& newest() const noexcept { return newest_; }

 private:
  [[nodiscard]] bool joins(const ObservedPhase& observed) const noexcept {
    if (count_ == 0 || observed.time < first_ || observed.time - first_ >= kEvery) return false;
    return observed.deviation_rad > 0.0 && kept_[(count_ - 1) % Capacity].deviation_rad > 0.0;
  }
  static void join(ObservedPhase& kept, const ObservedPhase& observed) noexcept {
    const double kept_weight = 1.0 / (kept.deviation_rad * kept.deviation_rad);
    const double weight = 1.0 / (observed.deviation_rad * observed.deviation_rad);
    const double share = weight / (kept_weight + weight);
    kept.time += from_seconds(share * to_seconds(observed.time - kept.time));
    kept.phase_rad += share * std::remainder(observed.phase_rad - kept.phase_rad, kTwoPi);
    kept.deviation_rad = 1.0 / std::sqrt(kept_weight + weight);
  }

  std::array<ObservedPhase, Capacity> kept_{};
  std::uint64_t count_ = 0;
  Instant first_;  // of those that are joined in the newest kept
  ObservedPhase newest_;
};

}  // namespace perimap
