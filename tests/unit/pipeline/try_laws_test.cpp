#include "core/pipeline/try_laws.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "core/phase/law_choice.hpp"
#include "core/pipeline/phase_basis.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr double kPixelDeviation_px = 0.3;

// A camera that looks along z and goes to and fro sideways; 100 mm before it a feature that follows one law in cycles
// of the lengths given, which are repeated.
struct Tried {
  EstimatorSettings settings;
  PixelModel model{{640, 480, 500, 500, 320, 240, 0, 0, 0, 0, 0}};
  std::unique_ptr<BatchStartExchange> start = std::make_unique<BatchStartExchange>();

  Tried(PhaseLaw truth, const std::vector<milliseconds>& lengths, Duration irregularity = Duration(0)) {
    settings.layout.cardiac_harmonics = 4;
    start->law.settings = law_even_at(PhaseLaw::kLinear, Seconds(0.85));
    start->law.probabilities.fill(1.0 / 3.0);
    std::mt19937 generator(5);
    std::normal_distribution<double> noise(0.0, kPixelDeviation_px);
    std::size_t number = 0;
    ObservedCycle observed;
    observed.cycle.begin = Instant(milliseconds(5000));
    observed.cycle.length = lengths[0];
    observed.cycle.previous_length = lengths.back();
    observed.cycle.begin_deviation = observed.cycle.length_deviation = milliseconds(1);
    observed.cycle.previous_length_deviation = milliseconds(1);
    observed.cycle.irregularity = irregularity;
    observed.cycle.completed = true;
    start->count = 90;
    for (int i = 0; i < start->count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Instant capture = Instant(milliseconds(5000)) + i * milliseconds(33);
      CardiacCycle& cycle = observed.cycle;
      while (capture >= cycle.begin + cycle.length) {
        cycle.begin += cycle.length;
        cycle.previous_length = cycle.length;
        cycle.length = lengths[++number % lengths.size()];
      }
      start->captures[k] = capture;
      start->cycles[k] = observed;
      Observation& o = start->observations[k];
      const double t_s = to_seconds(capture - start->captures[0]);
      Pose X_WC;
      X_WC.t.x() = 20.0 * std::sin(2.0 * t_s);
      o.X_CW = X_WC.inverse();
      const auto phase_under = [&](PhaseLaw law) {
        return phase_in_cycle(start->law.with(law), Seconds(capture - cycle.begin), cycle.length, cycle.previous_length)
            .phase_rad;
      };
      const double phase = phase_under(truth);
      o.b = basis_at(settings.layout, phase_under(PhaseLaw::kLinear), {});
      const Vector3d p(2.0 * std::sin(phase), 4.0 * std::cos(phase) + std::sin(2.0 * phase), 100.0);
      EXPECT_EQ(model.camera.project(o.X_CW * p, o.z), ProjectionStatus::kOk);
      o.z += Vector2d(noise(generator), noise(generator));
      o.R = kPixelDeviation_px * kPixelDeviation_px * Matrix2d::Identity();
    }
    start->outcome = batch_start(observations(), model, settings.layout, settings.prior, settings.batch);
  }

  [[nodiscard]] std::span<const Observation> observations() const {
    return {start->observations.data(), static_cast<std::size_t>(start->count)};
  }
  [[nodiscard]] std::optional<LawTrial> trial() const {
    return try_laws(*start, model, settings.layout, settings.prior, settings.batch);
  }
};

const std::vector<milliseconds> kUneven{milliseconds(850), milliseconds(620), milliseconds(1100), milliseconds(780)};

class TryLaws : public testing::TestWithParam<PhaseLaw> {};

TEST_P(TryLaws, TheLawThatTheHeartFollowsExplainsItBest) {
  const std::optional<LawTrial> trial = Tried(GetParam(), kUneven).trial();
  ASSERT_TRUE(trial);
  EXPECT_EQ(trial->begin, Instant(milliseconds(5000)));
  EXPECT_EQ(trial->end, Instant(milliseconds(5000 + 89 * 33)));
  for (const PhaseLaw other : kPhaseLaws) {
    if (other == GetParam()) continue;
    EXPECT_GT(trial->costs[index_of(other)], trial->costs[index_of(GetParam())] + 50.0) << index_of(other);
  }
}

TEST_P(TryLaws, ACycleThatEndedOutOfRhythmTellsAsMuch) {
  const std::optional<LawTrial> in_rhythm = Tried(GetParam(), kUneven).trial();
  const std::optional<LawTrial> trial = Tried(GetParam(), kUneven, milliseconds(200)).trial();
  ASSERT_TRUE(in_rhythm && trial);
  EXPECT_EQ(trial->costs, in_rhythm->costs);
}

INSTANTIATE_TEST_SUITE_P(TryLaws, TryLaws,
                         testing::Values(PhaseLaw::kLinear, PhaseLaw::kWarped, PhaseLaw::kTimeLocked));

TEST(TryLaws, EvenCyclesTellLittle) {
  const std::optional<LawTrial> trial = Tried(PhaseLaw::kWarped, {milliseconds(850)}).trial();
  ASSERT_TRUE(trial);
  // In a cycle of the usual length the laws are one, but not how sure each is of its phase.
  for (const double cost : trial->costs) EXPECT_NEAR(cost, trial->costs[0], 2.0);
}

TEST(TryLaws, WhatTheRPeaksLeaveUnknownIsLessEvidence) {
  Tried tried(PhaseLaw::kWarped, kUneven);
  const LawTrial known = tried.trial().value();
  for (ObservedCycle& observed : tried.start->cycles)
    observed.cycle.begin_deviation = observed.cycle.length_deviation = milliseconds(60);
  const LawTrial uncertain = tried.trial().value();
  const auto excess = [](const LawTrial& trial) {
    return trial.costs[index_of(PhaseLaw::kLinear)] - trial.costs[index_of(PhaseLaw::kWarped)];
  };
  EXPECT_LT(excess(uncertain), 0.7 * excess(known));
}

TEST(TryLaws, WhatNoLawExplainsGivesNoTrial) {
  Tried tried(PhaseLaw::kWarped, kUneven);
  // Half of the beats were missed.
  for (ObservedCycle& observed : tried.start->cycles) {
    observed.cycle.begin = Instant(milliseconds(5000));
    observed.cycle.length = milliseconds(3000);
  }
  EXPECT_FALSE(tried.trial());
}

TEST(TryLaws, NothingIsTriedWhileBreathingMayMoveItAll) {
  Tried tried(PhaseLaw::kWarped, kUneven);
  tried.start->cycles[40].respiration.deviation_mm = 5.0;
  EXPECT_FALSE(tried.trial());
}

TEST(TryLaws, AStartThatFailedUnderTheLawToldIsTriedFromItsOwnDepths) {
  Tried tried(PhaseLaw::kWarped, kUneven);
  const LawTrial trial = tried.trial().value();
  tried.start->outcome.status = BatchStatus::kTooManyOutliers;
  const std::optional<LawTrial> again = tried.trial();
  ASSERT_TRUE(again);
  EXPECT_NEAR(again->costs[index_of(PhaseLaw::kWarped)], trial.costs[index_of(PhaseLaw::kWarped)], 0.1);
}

TEST(TryLaws, ObservationsThatGiveNoCostGiveNoTrial) {
  Tried tried(PhaseLaw::kWarped, kUneven);
  tried.start->observations[3].z.x() = NAN;
  EXPECT_FALSE(tried.trial());
}

}  // namespace
}  // namespace perimap
