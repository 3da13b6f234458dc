// What outlives a crash: the map and what the clocks were learnt from, as values.
#pragma once

#include <cstdint>
#include <vector>

#include "core/estimation/feature_estimate.hpp"
#include "core/phase/law_memory.hpp"
#include "core/phase/respiration_memory.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/setup_watch/setup_memory.hpp"
#include "core/time/instant.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// One mapped feature.
struct FeatureMemory {
  std::uint32_t id = 0;
  Instant first_observed;
  Vector2d first_observed_px = Vector2d::Zero();
  Instant last_observed;
  PatchTemplate patch;
  PatchState patch_state;
  int updates = 0;
  bool converged = false;
  double largest_deviation_mm = 0.0;
  FeatureEstimate estimate;  // with what a slow error of the tracker adds to its covariance
  bool breathing = false;    // breathing had begun: it is in the estimate, in the phase of RespirationMemory
};

struct MapMemory {
  std::vector<FeatureMemory> features;
  RespirationMemory respiration;
  LawMemory law;
  SetupMemory setup;
  // The last seconds of the ECG. Heard again they teach detector, classes and clock what they knew.
  std::vector<EcgBlock> ecg;
  // Of the last release, from which the frame times go on.
  Instant last_capture;
  Duration frame_period{0};  // 0: no frame had come
};

}  // namespace perimap
