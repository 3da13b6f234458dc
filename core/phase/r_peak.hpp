// One R peak of the ECG.
#pragma once

#include <cstdint>

#include "core/phase/qrs_shape.hpp"
#include "core/time/instant.hpp"

namespace perimap {

enum class BeatClass : std::uint8_t {
  kNormal,
  kPremature,  // early, and of another shape (ventricular) or of the same (atrial); or ventricular and on time
  kPause,      // later than the rhythm allows: after it the cycle is no guide to the next
  kNoise       // the detection is thought false: no beat
};

// Whether the cycle between two such beats is a guide to others: not one that begins with a premature beat, and not one
// that ends with anything but a normal one.
[[nodiscard]] constexpr bool cycle_teaches(BeatClass begin, BeatClass end) noexcept {
  return begin != BeatClass::kPremature && end == BeatClass::kNormal;
}

struct RPeak {
  Instant time;             // of the peak itself, finer than the sample period
  Instant detected_at;      // stamp of the sample that made it known; later than `time` by the detector's delay
  double confidence = 0.0;  // 0 to 1: how far it stands out from noise and how much it resembles the beats before
  Duration deviation{0};    // standard deviation of `time`
  BeatClass beat_class = BeatClass::kNormal;  // as the beat classer says; the detector and hardware triggers leave it
  bool unusual_shape = false;                 // as the beat classer says: not the patient's usual QRS complex
  QrsShape shape{};                           // of no points where there is no ECG around the beat
};

}  // namespace perimap
