// The R peak detector in bursts of electrosurgery and while the electrode is off: no beat is believed, and those after
// are right.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/phase/r_peak_detector.hpp"
#include "lead_disturbances.hpp"
#include "made_lead.hpp"

namespace perimap::test {
namespace {

using Generator = std::mt19937_64;

struct Stretch {
  double begin_s = 0.0;
  double end_s = 0.0;
};

double uniform(double from, double to, Generator& generator) {
  return std::uniform_real_distribution<double>(from, to)(generator);
}

struct Outcome {
  int stretches = 0;
  int unsaid = 0;  // stretches a second after whose begin the line is still called good
  int bad = 0;     // stretches with a beat that is none and has a confidence above 0.5
  int late = 0;    // after which one of the fourth to sixth beats is missed
  int outside = 0;
  int missed = 0;  // of the beats outside
  int extra = 0;
};

class Disturbed {
 public:
  explicit Disturbed(Disturb disturb) : disturb_(std::move(disturb)) {}

  // Six leads of four minutes; stretches are so long, evenly in the logarithm.
  Outcome run(double shortest_s, double longest_s) {
    Outcome outcome;
    for (int k = 0; k < 6; ++k) {
      MadeLeadSettings settings;
      settings.per_minute = 55.0 + 12.0 * k;
      settings.t = 0.2 + 0.1 * k;
      settings.sign = k % 2 == 0 ? 1.0 : -1.0;
      settings.noise_mV = 0.02;
      settings.duration_s = 240.0;
      settings.seed = generator_();
      judge(settings, shortest_s, longest_s, outcome);
    }
    return outcome;
  }

 private:
  void judge(const MadeLeadSettings& settings, double shortest_s, double longest_s, Outcome& outcome) {
    MadeLead lead = make_lead(settings);
    std::vector<Stretch> stretches;
    for (double at_s = 40.0;;) {
      const double length_s = std::exp(uniform(std::log(shortest_s), std::log(longest_s), generator_));
      if (at_s + length_s + 8.0 > settings.duration_s) break;
      stretches.push_back({at_s, at_s + length_s});
      const auto sample = [&](double t) { return static_cast<std::size_t>(t * lead.rate_hz); };
      disturb_(lead, sample(at_s), sample(at_s + length_s), generator_);
      at_s += length_s + uniform(10.0, 25.0, generator_);
    }
    const auto detector = std::make_unique<RPeakDetector>();
    std::vector<RPeak> peaks;
    std::vector<bool> called_good;
    for (std::size_t i = 0; i < lead.mV.size(); ++i) {
      const Instant t(from_seconds(static_cast<double>(i) / lead.rate_hz));
      if (const auto peak = detector->push(t, lead.mV[i])) peaks.push_back(*peak);
      called_good.push_back(detector->signal() == EcgSignal::kGood);
    }
    const auto time_s = [](const RPeak& peak) { return to_seconds(peak.time.time_since_epoch()); };
    const auto found = [&](double beat_s) {
      return std::any_of(peaks.begin(), peaks.end(),
                         [&](const RPeak& p) { return std::abs(time_s(p) - beat_s) < 0.15; });
    };
    const auto real = [&](const RPeak& peak) {
      return std::any_of(lead.beats_s.begin(), lead.beats_s.end(),
                         [&](double beat_s) { return std::abs(time_s(peak) - beat_s) < 0.15; });
    };
    const auto inside = [&](double t) {
      return std::any_of(stretches.begin(), stretches.end(),
                         [&](const Stretch& s) { return t > s.begin_s - 0.1 && t < s.end_s + 0.3; });
    };
    for (const Stretch& stretch : stretches) {
      ++outcome.stretches;
      outcome.unsaid += called_good[static_cast<std::size_t>((stretch.begin_s + 1.0) * lead.rate_hz)] ? 1 : 0;
      outcome.bad += std::any_of(peaks.begin(), peaks.end(), [&](const RPeak& peak) {
        return time_s(peak) > stretch.begin_s && time_s(peak) < stretch.end_s && peak.confidence > 0.5 && !real(peak);
      });
      auto beat = std::lower_bound(lead.beats_s.begin(), lead.beats_s.end(), stretch.end_s + 0.2);
      bool late = false;
      for (int n = 0; n < 6 && beat != lead.beats_s.end(); ++n, ++beat) late = late || (n >= 3 && !found(*beat));
      outcome.late += late ? 1 : 0;
    }
    for (const double beat_s : lead.beats_s) {
      if (inside(beat_s)) continue;
      ++outcome.outside;
      outcome.missed += found(beat_s) ? 0 : 1;
    }
    for (const RPeak& peak : peaks) outcome.extra += !inside(time_s(peak)) && !real(peak) ? 1 : 0;
  }

  Disturb disturb_;
  Generator generator_{0xc4a91e6d52f03b78U};
};

struct Kind {
  DisturbedStretches stretches;
  int late_one_in;  // stretches, at most
  double most_unsaid = 1.0;
};

struct DisturbedLead : testing::TestWithParam<Kind> {};

TEST_P(DisturbedLead, NoBeatIsBelievedAndTheNextAreRight) {
  const Kind& kind = GetParam();
  const Outcome outcome = Disturbed(kind.stretches.disturb).run(kind.stretches.shortest_s, kind.stretches.longest_s);
  std::printf("%d stretches, %d bad, %d late, %d unsaid; of %d beats outside %d missed, %d extra\n", outcome.stretches,
              outcome.bad, outcome.late, outcome.unsaid, outcome.outside, outcome.missed, outcome.extra);
  EXPECT_GE(outcome.stretches, 25);
  EXPECT_LE(outcome.bad, outcome.stretches / 50);
  EXPECT_LE(outcome.late, outcome.stretches / kind.late_one_in);
  EXPECT_LE(outcome.unsaid, kind.most_unsaid * outcome.stretches);
  EXPECT_LE(outcome.missed + outcome.extra, outcome.outside * 2 / (kind.late_one_in * 5));
}

std::string name_of(const testing::TestParamInfo<Kind>& kind) {
  std::string name;
  for (const char c : kind.param.stretches.name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Electrosurgery, DisturbedLead,
                         testing::Values(Kind{electrosurgery()[0], 50}, Kind{electrosurgery()[1], 50},
                                         Kind{electrosurgery()[2], 50}, Kind{electrosurgery()[3], 50}),
                         name_of);
INSTANTIATE_TEST_SUITE_P(LeadOff, DisturbedLead,
                         testing::Values(Kind{leads_off()[0], 12, 0.05}, Kind{leads_off()[1], 50, 0.2},
                                         Kind{leads_off()[2], 12, 0.05}, Kind{leads_off()[3], 50, 0.05},
                                         Kind{leads_off()[4], 50, 0.05}),
                         name_of);

}  // namespace
}  // namespace perimap::test
