// The R peak detector on made leads whose P and T waves may be as large as the QRS complex.
#include "made_lead.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "core/phase/r_peak_detector.hpp"

namespace perimap::test {
namespace {

struct Outcome {
  int missed = 0;
  int extra = 0;
  int wrong = 0;  // of the extra, told with more than 0.7
  int beats = 0;

  [[nodiscard]] double f1_percent() const {
    const int found = beats - missed;
    return 200.0 * found / std::max(2 * found + missed + extra, 1);
  }
};

// One to one within 150 ms.
Outcome detect(const MadeLead& lead) {
  const auto detector = std::make_unique<RPeakDetector>();
  std::vector<RPeak> peaks;
  for (std::size_t i = 0; i < lead.mV.size(); ++i) {
    const Instant t(from_seconds(static_cast<double>(i) / lead.rate_hz));
    if (const auto peak = detector->push(t, lead.mV[i])) peaks.push_back(*peak);
  }
  while (const auto peak = detector->flush()) peaks.push_back(*peak);
  Outcome outcome;
  outcome.beats = static_cast<int>(lead.beats_s.size());
  std::vector<bool> used(peaks.size(), false);
  for (const double beat_s : lead.beats_s) {
    std::size_t nearest = peaks.size();
    double least_s = 0.150;
    for (std::size_t i = 0; i < peaks.size(); ++i) {
      const double apart_s = std::abs(to_seconds(peaks[i].time.time_since_epoch()) - beat_s);
      if (used[i] || apart_s > least_s) continue;
      nearest = i;
      least_s = apart_s;
    }
    if (nearest == peaks.size()) {
      ++outcome.missed;
    } else {
      used[nearest] = true;
    }
  }
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    if (used[i]) continue;
    ++outcome.extra;
    if (peaks[i].confidence > 0.7) ++outcome.wrong;
  }
  return outcome;
}

MadeLead load(const std::string& name) {
  MadeLead lead;
  lead.rate_hz = 360.0;
  std::string line;
  std::ifstream signal(PERIMAP_TEST_DATA "/made_ecg/" + name + ".csv");
  std::getline(signal, line);
  while (std::getline(signal, line)) lead.mV.push_back(std::stof(line.substr(line.find(',') + 1)));
  std::ifstream beats(PERIMAP_TEST_DATA "/made_ecg/" + name + "_beats.csv");
  std::getline(beats, line);
  while (std::getline(beats, line)) lead.beats_s.push_back(std::stod(line));
  return lead;
}

struct MadeEcg : testing::TestWithParam<const char*> {};

TEST_P(MadeEcg, NoOtherWaveIsTakenForTheBeat) {
  const MadeLead lead = load(GetParam());
  ASSERT_GT(lead.beats_s.size(), 40U);
  const Outcome outcome = detect(lead);
  EXPECT_EQ(outcome.missed, 0);
  EXPECT_LE(outcome.extra, 1);
  EXPECT_EQ(outcome.wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Failed, MadeEcg, testing::Values("t100", "d2", "q45_1", "qw50", "d17"),
                         [](const auto& name) { return std::string(name.param); });

struct Swept {
  int plain = 0;
  int calm = 0;         // of these without block and noise,
  int calm_failed = 0;  // with an F1 below 98 %
  int failed = 0;
  int wrong = 0;  // more than 2 % of the beats false and told with more than 0.7
};

Swept sweep(int draws) {
  std::mt19937_64 generator(0x5b1f7ac0e39d2468U);
  Swept swept;
  for (int i = 0; i < draws; ++i) {
    const MadeLeadSettings settings = draw_lead(generator);
    if (!is_plain(settings)) continue;
    const Outcome outcome = detect(make_lead(settings));
    const bool failed = outcome.f1_percent() < 98.0;
    const bool calm = !settings.block && settings.noise_mV < 0.05;
    ++swept.plain;
    swept.calm += calm ? 1 : 0;
    swept.failed += failed ? 1 : 0;
    swept.wrong += outcome.wrong > std::max(1.0, 0.02 * outcome.beats) ? 1 : 0;
    if (!calm || !failed) continue;
    ++swept.calm_failed;
    std::printf("F1 %.1f %%: %s\n", outcome.f1_percent(), settings.text().c_str());
  }
  std::printf("%d leads: F1 below 98 %% in %d; %d of them calm: in %d; wrong without doubt in %d\n", swept.plain,
              swept.failed, swept.calm, swept.calm_failed, swept.wrong);
  return swept;
}

// PERIMAP_LONG_SWEEP: that many draws, in the run labelled long.
TEST(MadeLeads, BeatsAreFoundWhateverTheirWavesAreLike) {
  const char* const asked = std::getenv("PERIMAP_LONG_SWEEP");
  const Swept swept = sweep(asked != nullptr ? std::atoi(asked) : 150);
  ASSERT_GT(swept.calm, 10);
  EXPECT_LE(swept.calm_failed, 0.01 * swept.calm);
  EXPECT_LE(swept.failed, 0.12 * swept.plain);
  EXPECT_LE(swept.wrong, 0.02 * swept.plain);
}

}  // namespace
}  // namespace perimap::test
