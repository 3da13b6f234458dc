// What the ECG thread runs, and what the mapper makes of heart and breathing, takes nothing from the heap once made. A
// program of its own, because it counts the calls of the allocator.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/heart_phase.hpp"
#include "core/pipeline/breathing.hpp"
#include "core/pipeline/ecg_intake.hpp"
#include "core/pipeline/evaluation_plan.hpp"
#include "counted_allocations.hpp"

namespace perimap {
namespace {

using test::allocations_of;

constexpr double kRate_hz = 360.0;

// A minute of a real record with all that leads the detector off its usual way: a burst, a gain that changes, a flat
// line, a lead that is off, a gap.
std::vector<EcgBlock> eventful_minute() {
  std::ifstream file(PERIMAP_TEST_DATA "/mitbih/105_60s.csv");
  std::string line;
  std::getline(file, line);
  std::vector<EcgBlock> blocks;
  std::mt19937 generator(3);
  std::normal_distribution<double> noise(0.0, 5.0);
  std::uint32_t i = 0;
  while (std::getline(file, line)) {
    const double t = i / kRate_hz;
    double mV = std::stod(line.substr(line.find(',') + 1));
    if (t > 12.0 && t < 14.0) mV = std::clamp(mV + noise(generator), -5.0, 5.0);
    if (t > 22.0 && t < 30.0) mV *= 10.0;
    if (t > 33.0 && t < 36.0) mV = 5.12;
    const bool off = t > 40.0 && t < 41.0;
    const bool missing = t > 48.0 && t < 49.0;
    if (!missing) {
      if (blocks.empty() || blocks.back().count == 32 || blocks.back().lead_off != off) {
        EcgBlock block;
        block.first_sample_time = Instant(from_seconds(t));
        block.sample_period = from_seconds(1.0 / kRate_hz);
        block.device_sequence = i;
        block.lead_off = off;
        blocks.push_back(block);
      }
      EcgBlock& block = blocks.back();
      block.mV[block.count++] = static_cast<float>(mV);
      block.arrival = Instant(from_seconds(t + 0.01));
    }
    ++i;
  }
  return blocks;
}

TEST(Allocation, TheEcgThreadTakesNothingFromTheHeap) {
  const std::vector<EcgBlock> blocks = eventful_minute();
  ASSERT_GT(blocks.size(), 600U);
  const auto cells = std::make_unique<EcgClockCells>();
  const auto counters = std::make_unique<PipelineCounters>();
  for (const RrMethod method : {RrMethod::kPrevious, RrMethod::kMeanOf8, RrMethod::kAutoregressive}) {
    EcgIntakeSettings settings;
    settings.clock.predictor = method;
    const auto intake = std::make_unique<EcgIntake>(settings, *cells, *counters);
    const long count = allocations_of([&] {
      for (const EcgBlock& block : blocks) intake->push(block);
    });
    EXPECT_EQ(count, 0);
  }
  // The way went through all that it was to go through.
  EXPECT_GT(counters->ecg_dropped.get(), 0U);
  EXPECT_GT(counters->ecg_lead_off.get(), 2U * 360U);
  EXPECT_TRUE(cells->mapper.update());
}

TEST(Allocation, TheEndOfASignalTakesNothingFromTheHeap) {
  const std::vector<EcgBlock> blocks = eventful_minute();
  const auto detector = std::make_unique<RPeakDetector>();
  int beats = 0;
  const long count = allocations_of([&] {
    for (std::size_t b = 0; b < 100; ++b) {
      Instant t = blocks[b].first_sample_time;
      for (const float mV : blocks[b].samples()) {
        beats += detector->push(t, mV) ? 1 : 0;
        t += blocks[b].sample_period;
      }
    }
    while (detector->flush()) ++beats;
  });
  EXPECT_EQ(count, 0);
  EXPECT_GT(beats, 8);
}

// A heart of which half of the R peaks are heard 1 ms late, which the phases seen show; then another patient's.
TEST(Allocation, WhatIsBelievedOfTheHeartTakesNothingFromTheHeap) {
  HeartPhaseSettings settings;
  settings.law_from_image = true;
  const auto heart = std::make_unique<HeartPhase>(settings);
  CardiacClockTracker tracker{CardiacClockSettings{}};
  constexpr double kRr_s = 0.8;
  Duration moved{0};
  int laws = 0;
  const long count = allocations_of([&] {
    for (int beat = 0; beat < 60; ++beat) {
      const Instant peak(from_seconds(kRr_s * beat + 0.001 * (beat % 2)));
      tracker.on_r_peak({peak, peak + std::chrono::milliseconds(90), 1.0, std::chrono::milliseconds(2)});
      for (std::size_t i = 0; beat == 20 && i < 2 * HeartPhase::kMostTrials; ++i) {
        heart->add({{20.0, 80.0, 80.0}, peak - std::chrono::seconds(2), peak});
      }
      for (int i = 0; i < 26; ++i) {
        const double s = 0.01 + 0.03 * i;
        const Instant seen(from_seconds(kRr_s * beat + s));
        laws += heart->begin_frame(tracker.clock(), seen, seen).other_laws ? 1 : 0;
        heart->observe({ImagePhaseOutcome::kObserved, {seen, 2.0 * std::numbers::pi * s / kRr_s, 0.01}});
        static_cast<void>(heart->belief().clock(tracker.clock(), seen));
        const CardiacClock clock = heart->completed();
        moved = std::max(moved, clock.anchor() < peak ? peak - clock.anchor() : clock.anchor() - peak);
      }
    }
    heart->recall(heart->law_memory());
    *heart = HeartPhase(settings, heart->beats());
  });
  EXPECT_EQ(count, 0);
  EXPECT_GT(moved, std::chrono::microseconds(200));
  EXPECT_GT(laws, 0);
}

// Breathing of 10 mm every 4 s that is found, followed and lost; then another patient's.
TEST(Allocation, WhatIsBelievedOfBreathingAndWhatIsEvaluatedTakesNothingFromTheHeap) {
  PipelineSettings settings;
  settings.respiration.enabled = true;
  settings.clock_period = std::chrono::milliseconds(10);
  const auto history = std::make_unique<FrameHistory>(BasisLayout{2, 2});
  const auto breathing = std::make_unique<Breathing>(settings.respiration);
  const CardiacClock heart;
  int begun = 0;
  const long count = allocations_of([&] {
    for (int i = 0; i < 30 * 30; ++i) {
      const double t_s = 5.0 + i / 30.0;
      begun += breathing->begin_frame(*history).begun ? 1 : 0;
      FrameRecord& frame = history->append({history->count(), Instant(from_seconds(t_s)), Instant(from_seconds(t_s))});
      history->set_phase(frame, heart, breathing->clock());
      breathing->expect_displacement(frame);
      static_cast<void>(plan_evaluation(*history, frame, frame.stamp.arrival, settings));
      if (breathing->asks_for_displacement(frame, false)) {
        const double sine = std::sin(std::numbers::pi * t_s / 4.0);
        breathing->add_displacement(frame, 10.0 * std::pow(sine, 4) * Vector3d(0.1, -0.35, -0.93));
      }
      if (i > 25 * 30)
        static_cast<void>(breathing->observe({ImagePhaseOutcome::kContradicts, {}}, frame.stamp.capture));
      breathing->search(frame);
    }
    *breathing = Breathing(settings.respiration);
  });
  EXPECT_EQ(count, 0);
  EXPECT_GT(begun, 0);
}

}  // namespace
}  // namespace perimap
