#include "core/phase/r_peak_smoother.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
constexpr double kTwoPi = 2.0 * std::numbers::pi;

// A heart that follows a law from R peak to R peak; the ECG's are off by chance, and the map's phase by an offset.
struct Beats : ::testing::Test {
  static constexpr double kPeakDeviation_s = 1.5e-3;
  static constexpr double kSeenDeviation_s = 4e-3;
  static constexpr std::size_t kBeats = 60;

  CardiacClockSettings settings;
  double map_early_s = 0.0;
  double outliers = 0.0;  // share of the phases seen that are
  Duration frame = milliseconds(16);
  std::mt19937 generator{5};

  RPeakSmoother smoother;
  CardiacClockTracker tracker{settings};
  std::vector<Instant> truth;  // R peaks; those of the ECG in `heard`
  std::vector<Instant> heard;
  std::vector<double> moved_s;      // of each R peak, as told when it ended its cycle
  std::vector<double> deviation_s;  // and as uncertain

  double normal(double deviation) { return std::normal_distribution<double>(0.0, deviation)(generator); }

  void run(std::size_t beats = kBeats) {
    tracker = CardiacClockTracker(settings);
    for (std::size_t i = 0; i < beats; ++i) next_beat(0.8 + normal(0.02));
  }

  void next_beat(double rr_s) {
    if (truth.empty()) truth = {from_ns(5'000'000'000) - from_seconds(0.8), from_ns(5'000'000'000)};
    const Instant begin = truth.back();
    const Duration previous = begin - truth[truth.size() - 2];
    const Duration length = from_seconds(rr_s);
    std::bernoulli_distribution is_outlier(outliers);
    for (Instant t = begin; t < begin + length; t += frame) {
      const CyclePhase phase = phase_in_cycle(settings.law, t - begin, length, previous);
      const double early_s = map_early_s + normal(kSeenDeviation_s) + (is_outlier(generator) ? 0.06 : 0.0);
      smoother.add({t, phase.phase_rad + phase.rate_rad_per_s * early_s, phase.rate_rad_per_s * kSeenDeviation_s});
    }
    truth.push_back(begin + length);
    heard.push_back(truth.back() + from_seconds(normal(kPeakDeviation_s)));
    tracker.on_r_peak({heard.back(), heard.back() + milliseconds(90), 1.0, from_seconds(kPeakDeviation_s)});
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
      const CyclePhase phase =
          phase_in_cycle(settings.law, t - truth[i], truth[i + 1] - truth[i], truth[i] - truth[i - 1]);
      const auto error_s2 = [&](const CardiacClock& clock) {
        return std::pow(std::remainder(clock.at(t).phase_rad - phase.phase_rad, kTwoPi) / phase.rate_rad_per_s, 2);
      };
      by_ecg_s2 += error_s2(tracker.clock());
      moved_s2 += error_s2(moved);
    }
  }
  EXPECT_LT(std::sqrt(moved_s2 / by_ecg_s2), 0.7);
}

INSTANTIATE_TEST_SUITE_P(Laws, BeatsOfALaw, ::testing::ValuesIn(kPhaseLaws),
                         [](const auto& law) { return "Law" + std::to_string(index_of(law.param)); });

TEST_F(Beats, AreAsUncertainAsTold) {
  double squares = 0.0;
  constexpr int kRuns = 30;
  for (int i = 0; i < kRuns; ++i) {
    smoother.forget();
    truth.clear();
    heard.clear();
    moved_s.clear();
    deviation_s.clear();
    run();
    for (std::size_t beat = kSettled; beat < kBeats; ++beat) squares += std::pow(error_s(beat) / deviation_s[beat], 2);
  }
  squares /= static_cast<double>(kRuns * (kBeats - kSettled));
  // Less than 1 because errors are taken to be alike in some frames in a row; here they are not.
  EXPECT_LT(squares, 1.1);
  EXPECT_GT(squares, 0.3);
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
  EXPECT_LT(scatter_s(), 0.8 * kPeakDeviation_s);
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
