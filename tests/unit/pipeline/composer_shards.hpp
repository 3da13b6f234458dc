// Shards, clock and settings that the tests of the surface composer share.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <utility>

#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/pipeline/surface_composer.hpp"

namespace perimap {

using std::chrono::milliseconds;

inline constexpr int kHarmonics = 2;

inline Instant at_ms(int ms) { return Instant(milliseconds(ms)); }

// Beats every 800 ms from 1 s on, the last at 9 s.
inline CardiacClock steady_clock() {
  CardiacClockTracker tracker({});
  for (int ms = 1000; ms <= 9000; ms += 800) {
    tracker.on_r_peak({at_ms(ms), at_ms(ms + 60), 1.0, milliseconds(1)});
  }
  return tracker.clock();
}

inline FeatureSnapshot feature(std::uint32_t id, double amplitude_mm) {
  FeatureSnapshot snapshot;
  snapshot.id = id;
  snapshot.state = FeatureState::kConverged;
  snapshot.x = StateVector::Zero(3 * (1 + 2 * kHarmonics));
  snapshot.x(0) = 10.0;          // DC of x
  snapshot.x(1) = amplitude_mm;  // a_1 of x
  snapshot.covariances_W_mm2.fill(0.04 * Matrix3d::Identity());
  snapshot.largest_deviation_mm = 0.5;
  snapshot.expected = true;
  snapshot.in_sight = true;
  return snapshot;
}

inline constexpr Release kRelease{100, Instant(milliseconds(9150)), Instant(milliseconds(9200)), false};

// Evaluated at the release of its own frame and at those of the two before it, 30 ms apart.
inline ShardSnapshot shard(std::uint64_t frame_sequence, std::initializer_list<FeatureSnapshot> features) {
  ShardSnapshot snapshot;
  snapshot.any = true;
  snapshot.frame_sequence = frame_sequence;
  for (std::size_t i = 0; i < kReleasesCovered; ++i) {
    const auto frames = static_cast<int>(frame_sequence + i) - static_cast<int>(kRelease.frame_sequence) - 2;
    snapshot.instants[i] = kRelease.deadline + milliseconds(30 * frames);
  }
  snapshot.features = features;
  return snapshot;
}

inline ComposerSettings settings() {
  ComposerSettings s;
  s.layout.cardiac_harmonics = kHarmonics;
  s.maximum_features = 8;
  return s;
}

}  // namespace perimap
