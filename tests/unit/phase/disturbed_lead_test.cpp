// The R peak detector in bursts of electrosurgery and while the electrode is off: no beat is believed, and those after
// are right.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "core/phase/r_peak_detector.hpp"
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

// Puts a disturbance in the lead's place, or on top of it.
using Disturb = std::function<void(MadeLead& lead, std::size_t begin, std::size_t end, Generator& generator)>;

void arcs(MadeLead& lead, std::size_t begin, std::size_t end, Generator& generator) {
  for (double at_s = static_cast<double>(begin) / lead.rate_hz; at_s < static_cast<double>(end) / lead.rate_hz;
       at_s += uniform(0.05, 0.5, generator)) {
    const double height = uniform(0.5, 4.0, generator) * (uniform(0.0, 1.0, generator) < 0.5 ? -1.0 : 1.0);
    const double sigma_s = uniform(0.005, 0.02, generator);
    const bool biphasic = uniform(0.0, 1.0, generator) < 0.5;
    for (std::size_t i = begin; i < end; ++i) {
      const double x = (static_cast<double>(i) / lead.rate_hz - at_s) / sigma_s;
      if (std::abs(x) > 5.0) continue;
      lead.mV[i] += static_cast<float>(height * (biphasic ? -x * std::exp(0.5 - 0.5 * x * x) : std::exp(-0.5 * x * x)));
    }
  }
}

// The line is at one rail or another, for so long each.
Disturb rails(double shortest_s, double longest_s, bool any_level) {
  return [=](MadeLead& lead, std::size_t begin, std::size_t end, Generator& generator) {
    std::normal_distribution<double> noise(0.0, 0.01);
    double level = 5.0;
    auto next = static_cast<double>(begin);
    for (std::size_t i = begin; i < end; ++i) {
      if (static_cast<double>(i) >= next) {
        level = any_level ? uniform(-5.0, 5.0, generator) : uniform(0.0, 1.0, generator) < 0.5 ? -5.0 : 5.0;
        next += 1.0 + uniform(shortest_s, longest_s, generator) * lead.rate_hz;
      }
      lead.mV[i] = static_cast<float>(level + noise(generator));
    }
  };
}

void wide_band(MadeLead& lead, std::size_t begin, std::size_t end, Generator& generator) {
  std::normal_distribution<double> noise(0.0, uniform(1.0, 6.0, generator));
  for (std::size_t i = begin; i < end; ++i) {
    lead.mV[i] = static_cast<float>(std::clamp(static_cast<double>(lead.mV[i]) + noise(generator), -5.0, 5.0));
  }
}

void blanking(MadeLead& lead, std::size_t begin, std::size_t end, Generator& generator) {
  std::normal_distribution<double> bits(0.0, 0.3);
  const double time_s = uniform(0.3, 1.2, generator);
  const double off_mV = uniform(-4.0, 4.0, generator);
  for (std::size_t i = begin; i < end; ++i) lead.mV[i] = static_cast<float>(0.005 * std::round(bits(generator)));
  for (std::size_t i = end; i < lead.mV.size(); ++i) {
    lead.mV[i] += static_cast<float>(off_mV * std::exp(-static_cast<double>(i - end) / lead.rate_hz / time_s));
  }
}

void hum_and_drift(MadeLead& lead, std::size_t begin, std::size_t end, Generator& generator) {
  const double amplitude_mV = uniform(0.3, 2.0, generator);
  const double frequency_hz = uniform(49.0, 61.0, generator);
  for (std::size_t i = begin; i < end; ++i) {
    const double t = 2.0 * std::numbers::pi * static_cast<double>(i - begin) / lead.rate_hz;
    lead.mV[i] = static_cast<float>(amplitude_mV * std::sin(frequency_hz * t) + 3.0 * std::sin(0.13 * t));
  }
}

// A line of an amplifier without a patient.
void still(MadeLead& lead, std::size_t begin, std::size_t end, Generator& generator) {
  std::normal_distribution<double> bits(0.0, 1.0);
  for (std::size_t i = begin; i < end; ++i) lead.mV[i] = static_cast<float>(0.004 * std::round(bits(generator)));
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
  const char* name;
  Disturb disturb;
  double shortest_s;
  double longest_s;
  int late_one_in;  // stretches, at most
  double most_unsaid = 1.0;
};

struct DisturbedLead : testing::TestWithParam<Kind> {};

TEST_P(DisturbedLead, NoBeatIsBelievedAndTheNextAreRight) {
  const Kind& kind = GetParam();
  const Outcome outcome = Disturbed(kind.disturb).run(kind.shortest_s, kind.longest_s);
  std::printf("%d stretches, %d bad, %d late, %d unsaid; of %d beats outside %d missed, %d extra\n", outcome.stretches,
              outcome.bad, outcome.late, outcome.unsaid, outcome.outside, outcome.missed, outcome.extra);
  EXPECT_GE(outcome.stretches, 25);
  EXPECT_LE(outcome.bad, outcome.stretches / 50);
  EXPECT_LE(outcome.late, outcome.stretches / kind.late_one_in);
  EXPECT_LE(outcome.unsaid, kind.most_unsaid * outcome.stretches);
  EXPECT_LE(outcome.missed + outcome.extra, outcome.outside * 2 / (kind.late_one_in * 5));
}

INSTANTIATE_TEST_SUITE_P(Electrosurgery, DisturbedLead,
                         testing::Values(Kind{"Arcs", arcs, 1.0, 20.0, 50},
                                         Kind{"Rails", rails(0.003, 0.3, false), 1.0, 20.0, 50},
                                         Kind{"Noise", wide_band, 1.0, 20.0, 50},
                                         Kind{"Blanking", blanking, 1.0, 20.0, 50}),
                         [](const auto& kind) { return std::string(kind.param.name); });
INSTANTIATE_TEST_SUITE_P(LeadOff, DisturbedLead,
                         testing::Values(Kind{"Rails", rails(0.02, 0.8, false), 5.0, 30.0, 12, 0.05},
                                         Kind{"Steps", rails(0.1, 1.5, true), 5.0, 30.0, 50, 0.2},
                                         Kind{"Noise", wide_band, 5.0, 30.0, 12, 0.05},
                                         Kind{"HumAndDrift", hum_and_drift, 5.0, 30.0, 50, 0.05},
                                         Kind{"Still", still, 5.0, 30.0, 50, 0.05}),
                         [](const auto& kind) { return std::string(kind.param.name); });

}  // namespace
}  // namespace perimap::test
