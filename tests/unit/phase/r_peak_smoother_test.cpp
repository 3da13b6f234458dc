#include "core/phase/r_peak_smoother.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

// A heart that follows a law from R peak to R peak; the ECG's are off by chance, and the map's phase by an offset.
struct Beats : ::testing::Test {
  static constexpr double kPeakDeviation_s = 1.5e-3;
  static constexpr double kSeenDeviation_s = 2.5e-3;
  static constexpr std::size_t kBeats = 60;

  CardiacClockSettings settings;
  double peak_deviation_s = kPeakDeviation_s;
  double seen_deviation_s = kSeenDeviation_s;  // of the phases seen; their errors fade in
  double alike_s = 0.0;                        // so long
  double map_early_s = 0.0;
  double outliers = 0.0;  // share of the phases seen that are
  Duration frame = milliseconds(16);
  std::mt19937 generator{5};

  RPeakSmoother smoother;
  CardiacClockTracker tracker{settings};
  double noise_s = 0.0;
  std::vector<Instant> truth;  // R peaks; those of the ECG in `heard`
  std::vector<Instant> heard;
  std::vector<double> moved_s;      // of each R peak, as told when it ended its cycle
  std::vector<double> deviation_s;  // and as uncertain

  double normal(double deviation) { return std::normal_distribution<double>(0.0, deviation)(generator); }

  void begin() {
    smoother.forget();
    tracker = CardiacClockTracker(settings);
    truth.clear();
    heard.clear();
    moved_s.clear();
    deviation_s.clear();
  }
  void run(std::size_t beats = kBeats) {
    begin();
    for (std::size_t i = 0; i < beats; ++i) next_beat(0.8 + normal(0.02));
  }

  void next_beat(double rr_s) { next_beat(rr_s, normal(peak_deviation_s), peak_deviation_s); }

  // The R peak at its end is heard so late, as uncertain as told.
  void next_beat(double rr_s, double late_s, double told_deviation_s) {
    if (truth.empty()) truth = {from_ns(5'000'000'000) - from_seconds(0.8), from_ns(5'000'000'000)};
    const Instant begin = truth.back();
    const Duration previous = begin - truth[truth.size() - 2];
    const Duration length = from_seconds(rr_s);
    std::bernoulli_distribution is_outlier(outliers);
    for (Instant t = begin; t < begin + length; t += frame) {
      const CyclePhase phase = phase_in_cycle(settings.law, t - begin, length, previous);
      const double fades = alike_s > 0.0 ? std::exp(-to_seconds(frame) / alike_s) : 0.0;
      noise_s = fades * noise_s + normal(std::sqrt(1.0 - fades * fades) * seen_deviation_s);
      const double early_s = map_early_s + noise_s + (is_outlier(generator) ? 0.06 : 0.0);
      smoother.add({t, phase.phase_rad + phase.rate_rad_per_s * early_s, phase.rate_rad_per_s * seen_deviation_s});
    }
    truth.push_back(begin + length);
    heard.push_back(truth.back() + from_seconds(late_s));
    tracker.on_r_peak({heard.back(), heard.back() + milliseconds(90), 1.0, from_seconds(told_deviation_s)});
    smoother.on_beat(tracker.clock());
    const CardiacClock moved = smoother.moved(tracker.clock());
    moved_s.push_back(to_seconds(moved.anchor() - heard.back()));
    deviation_s.push_back(to_seconds(moved.anchor_deviation()));
  }

  // After the first beats, in which the rhythm and the map's phase are found.
  static constexpr std::size_t kSettled = 30;
  [[nodiscard]] double error_s(std::size_t beat) const {
    return to_seconds(heard[beat] - truth[beat + 2]) + moved_s[beat];
  }
  // About their mean, which is the map's phase: no motion can tell it from the R peaks'.
  [[nodiscard]] double scatter_s() const {
    double sum = 0.0;
    double squares = 0.0;
    const auto n = static_cast<double>(heard.size() - kSettled);
    for (std::size_t i = kSettled; i < heard.size(); ++i) {
      sum += error_s(i);
      squares += error_s(i) * error_s(i);
    }
    return std::sqrt(squares / n - sum * sum / n / n);
  }
  // Of what is told of instant t in the cycle that truly begins with truth[i].
  [[nodiscard]] double phase_error_s(const PhaseEstimate& told, std::size_t i, Instant t) const {
    const CyclePhase phase =
        phase_in_cycle(settings.law, t - truth[i], truth[i + 1] - truth[i], truth[i] - truth[i - 1]);
    return std::remainder(told.phase_rad - phase.phase_rad, kTwoPi) / phase.rate_rad_per_s;
  }
  [[nodiscard]] double mean_moved_s() const {
    double sum = 0.0;
    for (std::size_t i = kSettled; i < moved_s.size(); ++i) sum += moved_s[i];
    return sum / static_cast<double>(moved_s.size() - kSettled);
  }
};

struct BeatsOfALaw : Beats, ::testing::WithParamInterface<PhaseLaw> {};

TEST_P(BeatsOfALaw, CompletedCyclesHaveABetterPhase) {
  settings.law.law = GetParam();
  run();
  double by_ecg_s2 = 0.0;
  double moved_s2 = 0.0;
  for (std::size_t i = kSettled; i + 2 < kBeats; ++i) next_beat(0.8 + normal(0.02));
  const CardiacClock moved = smoother.moved(tracker.clock());
  for (std::size_t i = truth.size() - 20; i + 1 < truth.size(); ++i) {
    for (Instant t = truth[i] + milliseconds(20); t < truth[i + 1] - milliseconds(20); t += milliseconds(20)) {
      by_ecg_s2 += std::pow(phase_error_s(tracker.clock().at(t), i, t), 2);
      moved_s2 += std::pow(phase_error_s(moved.at(t), i, t), 2);
    }
  }
  EXPECT_LT(std::sqrt(moved_s2 / by_ecg_s2), 0.7);
}

INSTANTIATE_TEST_SUITE_P(Laws, BeatsOfALaw, ::testing::ValuesIn(kPhaseLaws),
                         [](const auto& law) { return "Law" + std::to_string(index_of(law.param)); });

// Whose phases are the truth.
TEST_P(BeatsOfALaw, AreFoundWhereTheyWere) {
  settings.law.law = GetParam();
  seen_deviation_s = 1e-5;
  constexpr double kRr_s = 0.49;  // so that the warped systole depends much on the cycle before
  constexpr double kLate_s = 0.003;
  begin();
  for (std::size_t i = 0; i < kBeats; ++i) next_beat(kRr_s, 0.0, kPeakDeviation_s);
  next_beat(kRr_s, kLate_s, kPeakDeviation_s);
  // Under the time-locked law no phase of the cycle that it ends depends on it but those at its end.
  EXPECT_NEAR(moved_s.back(), -kLate_s, 1e-4);
  const auto late_beat = heard.size() - 1;
  for (int i = 0; i < 3; ++i) {
    next_beat(kRr_s, 0.0, kPeakDeviation_s);
    EXPECT_NEAR(moved_s.back(), 0.0, 1e-4) << i + 1 << " cycles after";
    EXPECT_LT(deviation_s.back(), 0.5 * kPeakDeviation_s) << "not weighed";
    const Instant begin = smoother.moved(tracker.clock()).cycle_at(truth[late_beat + 2] + milliseconds(200)).begin;
    EXPECT_NEAR(to_seconds(begin - truth[late_beat + 2]), 0.0, 1e-4);
  }
}

struct Told : Beats, ::testing::WithParamInterface<std::tuple<PhaseLaw, int>> {};

// What the map gets wrong is alike for some time, however many frames there are in it.
TEST_P(Told, UncertaintyIsThatOfTheRPeaks) {
  settings.law.law = std::get<0>(GetParam());
  frame = std::chrono::microseconds(1'000'000 / std::get<1>(GetParam()));
  alike_s = 0.033;
  double squares = 0.0;
  constexpr int kRuns = 20;
  for (int i = 0; i < kRuns; ++i) {
    run();
    for (std::size_t beat = kSettled; beat < kBeats; ++beat) squares += std::pow(error_s(beat) / deviation_s[beat], 2);
  }
  squares /= static_cast<double>(kRuns * (kBeats - kSettled));
  EXPECT_LT(squares, 1.2);
  EXPECT_GT(squares, 0.5);
}

INSTANTIATE_TEST_SUITE_P(LawsAndFrameRates, Told,
                         ::testing::Combine(::testing::ValuesIn(kPhaseLaws), ::testing::Values(30, 60, 240)));

// R peaks that are hardly known, the worst that are weighed.
TEST_P(BeatsOfALaw, PoorlyKnownAreAsUncertainAsTold) {
  settings.law.law = GetParam();
  constexpr double kPoor_s = 0.020;
  double squares = 0.0;
  double by_ecg_s2 = 0.0;
  double moved_s2 = 0.0;
  int far = 0;
  int phases = 0;
  for (int late_ms = -50; late_ms <= 50; late_ms += 5) {
    run(40);
    next_beat(0.8, 0.001 * late_ms, kPoor_s);
    next_beat(0.8);
    const CardiacClock moved = smoother.moved(tracker.clock());
    for (std::size_t i = truth.size() - 3; i + 1 < truth.size(); ++i) {
      for (Instant t = truth[i] + milliseconds(10); t < truth[i + 1]; t += milliseconds(30)) {
        const PhaseEstimate by_ecg = tracker.clock().at(t);
        const PhaseEstimate told = moved.at(t);
        if (!by_ecg.teaches || !told.teaches) continue;
        by_ecg_s2 += std::pow(phase_error_s(by_ecg, i, t), 2);
        moved_s2 += std::pow(phase_error_s(told, i, t), 2);
        const double deviations = phase_error_s(told, i, t) / told.deviation_s;
        squares += deviations * deviations;
        far += std::abs(deviations) > 3.0 ? 1 : 0;
        ++phases;
      }
    }
  }
  ASSERT_GT(phases, 1000);
  EXPECT_LT(squares / phases, 1.2);
  EXPECT_LE(far, phases / 100);
  EXPECT_LT(std::sqrt(moved_s2 / by_ecg_s2), 0.2);
}

TEST_F(Beats, StayWhereTheEcgHasThemWhereThePhasesDoNotFit) {
  run();
  outliers = 0.6;
  next_beat(0.8);
  EXPECT_EQ(moved_s.back(), 0.0);
  EXPECT_EQ(deviation_s.back(), kPeakDeviation_s);
}

TEST_F(Beats, DoubtfulStayWhereTheEcgHasThem) {
  run();
  next_beat(0.8, 0.1, 0.087);
  EXPECT_EQ(moved_s.back(), 0.0);
  EXPECT_EQ(deviation_s.back(), 0.087);
  next_beat(0.8);
  const CardiacClock moved = smoother.moved(tracker.clock());
  EXPECT_EQ(moved.cycle_at(heard[kBeats] + milliseconds(300)).begin, heard[kBeats]);
}

// No device tells so, but a caller may.
TEST_F(Beats, WithoutDeviationsLeaveEverythingFinite) {
  begin();
  for (std::size_t i = 0; i < kBeats; ++i) {
    smoother.add({truth.empty() ? Instant{} : truth.back(), 0.0, 0.0});
    next_beat(0.8, 0.0, 0.0);
  }
  for (const double moved : moved_s) EXPECT_LT(std::abs(moved), 0.002);
  const Instant inside = heard[kBeats - 2] + milliseconds(300);
  EXPECT_TRUE(smoother.moved(tracker.clock()).at(inside).exact);
}

TEST_F(Beats, DoNotFollowAMapThatIsOff) {
  map_early_s = 0.005;
  run(120);
  EXPECT_NEAR(mean_moved_s(), 0.0, 0.0008);
  EXPECT_LT(scatter_s(), 0.75 * kPeakDeviation_s) << "but its motion still tells where they are";
}

TEST_F(Beats, AreFoundDespiteOutliers) {
  outliers = 0.1;
  run();
  EXPECT_LT(scatter_s(), 0.9 * kPeakDeviation_s);
  EXPECT_NEAR(mean_moved_s(), 0.0, 0.001);
}

TEST_F(Beats, StayWhereTheEcgHasThemWhenLittleWasSeen) {
  frame = milliseconds(400);
  run();
  for (const double moved : moved_s) EXPECT_EQ(moved, 0.0);
  EXPECT_EQ(deviation_s.back(), kPeakDeviation_s);
}

TEST_F(Beats, StayWhereTheEcgHasThemWhileTheMapIsYoung) {
  run();
  for (std::size_t i = 0; i < RPeakSmoother::kFirstCycles; ++i) EXPECT_EQ(moved_s[i], 0.0);
  EXPECT_NE(moved_s[kSettled], 0.0);
}

TEST_F(Beats, OfACycleOutOfRhythmStayWhereTheEcgHasThem) {
  run();
  EXPECT_NE(moved_s.back(), 0.0);
  next_beat(0.45);
  EXPECT_EQ(moved_s.back(), 0.0);
  EXPECT_EQ(deviation_s.back(), kPeakDeviation_s);
}

TEST_F(Beats, AreTheEcgsOnceForgotten) {
  run();
  smoother.forget();
  const CardiacClock moved = smoother.moved(tracker.clock());
  for (const Instant t : heard) EXPECT_EQ(moved.at(t).phase_rad, tracker.clock().at(t).phase_rad);
  EXPECT_EQ(moved.anchor(), heard.back());
}

}  // namespace
}  // namespace perimap
