// Phase laws and RR prediction against vectors of an independent implementation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/phase_law.hpp"
#include "core/phase/rr_predictor.hpp"

namespace perimap {
namespace {

// The autoregression of the vectors, before it was made to survive outliers.
const AutoregressionSettings kVectors{.ridge = 1e-2, .pull = 0.0, .clip = std::numeric_limits<double>::infinity()};

class PhaseGolden : public testing::Test {
 protected:
  void SetUp() override {
    std::ifstream file(PERIMAP_TEST_DATA "/golden/e_phase.json");
    golden_ = nlohmann::json::parse(file);
    r_s_ = golden_.at("R_peaks").get<std::vector<double>>();
    t_s_ = golden_.at("t").get<std::vector<double>>();
    warped_.law = PhaseLaw::kWarped;
    const auto& warp = golden_.at("warp");
    warped_.systole_fraction = warp.at("sys_frac").get<double>();
    warped_.systole_offset_s = warp.at("a").get<double>();
    warped_.systole_slope_s_per_bpm = warp.at("b").get<double>();
  }

  // Index of the last R peak at or before t.
  std::size_t beat_before(double t) const {
    return static_cast<std::size_t>(std::upper_bound(r_s_.begin(), r_s_.end(), t) - r_s_.begin()) - 1;
  }
  Seconds rr(std::size_t beat) const { return Seconds(r_s_[beat + 1] - r_s_[beat]); }

  Seconds predicted(RrMethod method, std::size_t after_intervals) const {
    RrPredictor predictor(method, kVectors);
    for (std::size_t i = 0; i < after_intervals; ++i) predictor.push(rr(i));
    std::array<Seconds, 1> next;
    predictor.predict(next);
    return next[0];
  }

  // |got - expected|_max <= 1e-9 |expected|_max, in cycles.
  template <class Phase>
  void expect_cycles(const std::string& name, Phase&& phase) const {
    const auto expected = golden_.at(name).get<std::vector<double>>();
    ASSERT_EQ(expected.size(), t_s_.size());
    const double scale = *std::max_element(expected.begin(), expected.end());
    for (std::size_t i = 0; i < t_s_.size(); ++i) {
      EXPECT_NEAR(phase(t_s_[i]), expected[i], 1e-9 * scale) << name << " at " << t_s_[i];
    }
  }

  double cycles(const PhaseLawSettings& law, double t, Seconds length) const {
    const std::size_t beat = beat_before(t);
    return phase_in_cycle(law, Seconds(t - r_s_[beat]), length, rr(beat - 1)).phase_rad / kTwoPi;
  }

  nlohmann::json golden_;
  std::vector<double> r_s_;
  std::vector<double> t_s_;
  PhaseLawSettings linear_;
  PhaseLawSettings warped_;
};

TEST_F(PhaseGolden, CompletedCyclesUnderBothLaws) {
  expect_cycles("exact", [&](double t) { return cycles(linear_, t, rr(beat_before(t))); });
  expect_cycles("exact_warp", [&](double t) { return cycles(warped_, t, rr(beat_before(t))); });
}

TEST_F(PhaseGolden, CausalPhaseByPreviousCycle) {
  const auto previous = [&](double t) { return predicted(RrMethod::kPrevious, beat_before(t)); };
  expect_cycles("causal_prev", [&](double t) { return cycles(linear_, t, previous(t)); });
  expect_cycles("causal_prev_warp", [&](double t) { return cycles(warped_, t, previous(t)); });
  expect_cycles("causal_prev_h100ms", [&](double t) {
    const std::size_t beat = beat_before(t);
    const CyclePhase now = phase_in_cycle(linear_, Seconds(t - r_s_[beat]), previous(t), rr(beat - 1));
    return std::fmod((now.phase_rad + 0.1 * now.rate_rad_per_s) / kTwoPi, 1.0);
  });
}

TEST_F(PhaseGolden, CausalPhaseByMeanOfEight) {
  expect_cycles("causal_mean8",
                [&](double t) { return cycles(linear_, t, predicted(RrMethod::kMeanOf8, beat_before(t))); });
}

TEST_F(PhaseGolden, CausalPhaseByAutoregression) {
  expect_cycles("causal_ar8",
                [&](double t) { return cycles(linear_, t, predicted(RrMethod::kAutoregressive, beat_before(t))); });
}

TEST_F(PhaseGolden, AutoregressionPredictsTheNextInterval) {
  for (const auto& entry : golden_.at("ar8_next_rr")) {
    const auto after = entry.at("after_beat").get<std::size_t>();
    const double expected = entry.at("rr").get<double>();
    EXPECT_NEAR(predicted(RrMethod::kAutoregressive, after).count(), expected, 1e-9 * expected) << "beat " << after;
  }
}

// The whole clock: R peaks one after another, asked while the cycle runs and again when it has ended.
TEST_F(PhaseGolden, ClockGivesCausalThenExactPhase) {
  const auto causal = golden_.at("causal_ar8").get<std::vector<double>>();
  const auto exact = golden_.at("exact").get<std::vector<double>>();
  const auto exact_warped = golden_.at("exact_warp").get<std::vector<double>>();
  const auto instant = [](double t_s) { return Instant(from_seconds(t_s + 100.0)); };
  CardiacClockSettings settings;
  settings.autoregression = kVectors;
  CardiacClockTracker tracker(settings);
  settings.law = warped_;
  CardiacClockTracker warped(settings);
  std::size_t i = 0;
  for (const double r : r_s_) {
    for (; i < t_s_.size() && t_s_[i] < r; ++i) {
      const PhaseEstimate estimate = tracker.clock().at(instant(t_s_[i]));
      ASSERT_EQ(estimate.state, PhaseState::kLocked);
      EXPECT_FALSE(estimate.exact);
      if (causal[i] < 1.0) {
        EXPECT_NEAR(estimate.phase_rad / kTwoPi, causal[i], 2e-9);  // stamps are whole nanoseconds
      }
    }
    tracker.on_r_peak({instant(r), instant(r), 1.0, Duration(0)});
    warped.on_r_peak({instant(r), instant(r), 1.0, Duration(0)});
  }
  ASSERT_EQ(i, t_s_.size());
  for (i = 0; i < t_s_.size(); ++i) {
    const PhaseEstimate estimate = tracker.clock().at(instant(t_s_[i]));
    EXPECT_TRUE(estimate.exact);
    EXPECT_NEAR(estimate.phase_rad / kTwoPi, exact[i], 2e-9);
    EXPECT_NEAR(warped.clock().at(instant(t_s_[i])).phase_rad / kTwoPi, exact_warped[i], 2e-9);
  }
}

}  // namespace
}  // namespace perimap
