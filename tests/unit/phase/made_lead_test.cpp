// The R peak detector on made leads whose P and T waves may be as large as the QRS complex.
#include "made_lead.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "core/phase/r_peak_detector.hpp"

namespace perimap::test {
namespace {

MadeOutcome detect(const MadeLead& lead) {
  const auto detector = std::make_unique<RPeakDetector>();
  std::vector<RPeak> peaks;
  for (std::size_t i = 0; i < lead.mV.size(); ++i) {
    const Instant t(from_seconds(static_cast<double>(i) / lead.rate_hz));
    if (const auto peak = detector->push(t, lead.mV[i])) peaks.push_back(*peak);
  }
  while (const auto peak = detector->flush()) peaks.push_back(*peak);
  return scored(lead, peaks);
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
  const MadeOutcome outcome = detect(lead);
  EXPECT_EQ(outcome.missed, 0);
  EXPECT_EQ(outcome.extra, 0);
  EXPECT_EQ(outcome.wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Failed, MadeEcg, testing::Values("t100", "d2", "q45_1", "qw50", "d17"),
                         [](const auto& name) { return std::string(name.param); });

// A wave that is as likely to be the QRS complex is told with doubt, or not at all.
struct Rivals : testing::TestWithParam<MadeLeadSettings> {};

TEST_P(Rivals, AreNotToldWithoutDoubt) {
  const MadeOutcome outcome = detect(make_lead(GetParam()));
  EXPECT_LE(outcome.wrong, 1);
}

MadeLeadSettings lead_with(double p, double t, double pr_s, double qrs_s, double p_sigma_s, double per_minute) {
  MadeLeadSettings s;
  s.p = p;
  s.t = t;
  s.pr_s = pr_s;
  s.qrs_s = qrs_s;
  s.p_sigma_s = p_sigma_s;
  s.per_minute = per_minute;
  return s;
}

INSTANTIATE_TEST_SUITE_P(Drawn, Rivals,
                         testing::Values(lead_with(0.24, 1.51, 0.181, 0.173, 0.020, 37.8),     // T beside each R
                                         lead_with(0.96, 0.27, 0.179, 0.166, 0.0177, 45.3),    // P and R are alike
                                         lead_with(0.76, 1.38, 0.153, 0.119, 0.0186, 95.7),    // P beside a high T
                                         lead_with(0.88, 1.51, 0.254, 0.163, 0.0192, 58.3)));  // P, R and T

// Noise that is always there is no disturbance: what recurs in it is known by its shape, and noise is not told in the
// beats' place. R is 1 mV.
struct NoisyLeads : testing::TestWithParam<double> {};

TEST_P(NoisyLeads, AreToldByWhatRecursInThem) {
  int missed = 0;
  int extra = 0;
  int beats = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    MadeLeadSettings s = lead_with(0.4, 0.3, 0.16, 0.072, 0.022, 35.0 + 8.0 * static_cast<double>(seed));
    s.rate_hz = GetParam();
    s.noise_mV = 0.16;
    s.seed = seed;
    const MadeOutcome outcome = detect(make_lead(s));
    missed += outcome.missed;
    extra += outcome.extra;
    beats += outcome.beats;
  }
  std::printf("%d beats, %d missed, %d false\n", beats, missed, extra);
  EXPECT_LE(missed + extra, 0.04 * beats) << "an F1 of 98 %";
}

INSTANTIATE_TEST_SUITE_P(Slow, NoisyLeads, testing::Values(100.0, 125.0),
                         [](const auto& rate) { return std::to_string(static_cast<int>(rate.param)); });

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
    const MadeOutcome outcome = detect(make_lead(settings));
    const bool failed = outcome.f1_percent() < 98.0;
    const bool calm = !settings.block && settings.noise_mV < 0.05;
    ++swept.plain;
    swept.calm += calm ? 1 : 0;
    swept.failed += failed ? 1 : 0;
    swept.wrong += outcome.confidently_wrong() ? 1 : 0;
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
