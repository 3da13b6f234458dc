// Two leads of one heart: never worse than the better one, and one is enough.
#include "core/phase/lead_pair.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "core/phase/beat_finder.hpp"
#include "made_lead.hpp"

namespace perimap::test {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr double kRate_hz = 360.0;
constexpr double kLater_s = 0.015;  // the second lead's R wave

std::size_t sample(double t_s) { return static_cast<std::size_t>(t_s * kRate_hz); }

struct Heart {
  std::vector<float> first;
  std::vector<float> second;
  std::vector<double> beats_s;
};

// 150 s of a heart, whose second lead is upside down, smaller, wider and later.
Heart heart(std::uint64_t seed, double per_minute = 72.0) {
  MadeLeadSettings settings;
  settings.per_minute = per_minute;
  settings.noise_mV = 0.02;
  settings.duration_s = 150.0;
  settings.rate_hz = kRate_hz;
  settings.seed = seed;
  const MadeLead first = make_lead(settings);
  settings.sign = -1.0;
  settings.qrs_s = 0.1;
  settings.t = 0.35;
  const MadeLead second = make_lead(settings);
  Heart heart{first.mV, std::vector<float>(first.mV.size()), first.beats_s};
  const auto later = static_cast<std::size_t>(kLater_s * kRate_hz);
  for (std::size_t i = 0; i < first.mV.size(); ++i) heart.second[i] = 0.6F * second.mV[i > later ? i - later : 0];
  return heart;
}

struct Heard {
  std::vector<LeadBeat> beats;
  std::vector<EcgSignal> signals;
  std::uint64_t interruptions = 0;
};

Heard listen(const std::vector<float>& first, const std::vector<float>& second) {
  const auto pair = std::make_unique<LeadPair>();
  Heard heard;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Instant t(from_seconds(static_cast<double>(i) / kRate_hz));
    if (const auto beat = pair->push(t, first[i], second[i])) heard.beats.push_back(*beat);
    heard.signals.push_back(pair->signal());
  }
  while (const auto beat = pair->flush()) heard.beats.push_back(*beat);
  heard.interruptions = pair->interruptions();
  return heard;
}

double time_s(const LeadBeat& beat) { return to_seconds(beat.peak.time.time_since_epoch()); }

struct Score {
  int missed = 0;
  int extra = 0;
  int believed = 0;  // of the extra ones, with a confidence above 0.5
  double rms_s = 0.0;
  double largest_delay_s = 0.0;
};

Score score(const Heard& heard, const std::vector<double>& beats_s, double from_s, double to_s) {
  Score score;
  double squares = 0.0;
  int found = 0;
  for (const double beat_s : beats_s) {
    if (beat_s < from_s || beat_s > to_s) continue;
    const auto near = std::find_if(heard.beats.begin(), heard.beats.end(),
                                   [&](const LeadBeat& b) { return std::abs(time_s(b) - beat_s) < 0.15; });
    if (near == heard.beats.end()) {
      ++score.missed;
      continue;
    }
    squares += (time_s(*near) - beat_s) * (time_s(*near) - beat_s);
    ++found;
  }
  for (const LeadBeat& beat : heard.beats) {
    score.largest_delay_s = std::max(score.largest_delay_s, to_seconds(beat.peak.detected_at - beat.peak.time));
    if (time_s(beat) < from_s || time_s(beat) > to_s) continue;
    const bool real = std::any_of(beats_s.begin(), beats_s.end(),
                                  [&](double beat_s) { return std::abs(time_s(beat) - beat_s) < 0.15; });
    score.extra += real ? 0 : 1;
    score.believed += !real && beat.peak.confidence > 0.5 ? 1 : 0;
  }
  score.rms_s = std::sqrt(squares / std::max(found, 1));
  return score;
}

constexpr double kFrom_s = 10.0;
constexpr double kTo_s = 149.0;

TEST(LeadPair, OneLeadIsHeardAsItsDetectorHearsIt) {
  const Heart h = heart(1);
  const auto pair = std::make_unique<LeadPair>();
  const auto detector = std::make_unique<RPeakDetector>();
  int beats = 0;
  for (std::size_t i = 0; i < h.first.size(); ++i) {
    const Instant t(from_seconds(static_cast<double>(i) / kRate_hz));
    const auto told = pair->push(t, h.first[i]);
    const auto alone = detector->push(t, h.first[i]);
    ASSERT_EQ(told.has_value(), alone.has_value());
    if (!told) continue;
    ++beats;
    EXPECT_EQ(told->peak.time, alone->time);
    EXPECT_EQ(told->peak.detected_at, alone->detected_at);
    EXPECT_EQ(told->peak.confidence, alone->confidence);
    EXPECT_EQ(told->lead, 0);
  }
  EXPECT_GT(beats, 150);
}

TEST(LeadPair, TellsEachBeatOnceAndAtOnceAndAtTheFirstLeadsTime) {
  const Heart h = heart(2);
  const Heard heard = listen(h.first, h.second);
  const Score s = score(heard, h.beats_s, kFrom_s, kTo_s);
  EXPECT_EQ(s.missed, 0);
  EXPECT_EQ(s.extra, 0);
  EXPECT_LT(s.rms_s, 0.004);
  std::vector<double> delays_s;
  for (const LeadBeat& beat : heard.beats) {
    if (time_s(beat) < 30.0) continue;  // what is seen for the first time may be anything
    EXPECT_GE(beat.peak.confidence, 0.9);
    delays_s.push_back(to_seconds(beat.peak.detected_at - beat.peak.time));
  }
  std::sort(delays_s.begin(), delays_s.end());
  EXPECT_LT(delays_s[delays_s.size() / 2], 0.11);
  EXPECT_LT(delays_s[delays_s.size() * 95 / 100], 0.15);
}

// The second lead's R waves come 15 ms later, which is learnt while both are heard.
TEST(LeadPair, ALeadThatFallsOffIsNotMissedAndTimesDoNotJump) {
  for (const bool first_falls : {true, false}) {
    Heart h = heart(first_falls ? 3 : 4);
    std::vector<float>& fallen = first_falls ? h.first : h.second;
    for (std::size_t i = static_cast<std::size_t>(70.3 * kRate_hz); i < fallen.size(); ++i) fallen[i] = kNone;
    const Heard heard = listen(h.first, h.second);
    const Score s = score(heard, h.beats_s, kFrom_s, kTo_s);
    EXPECT_EQ(s.missed, 0) << first_falls;
    EXPECT_EQ(s.extra, 0) << first_falls;
    EXPECT_EQ(heard.interruptions, 0U) << "one lead is enough";
    EXPECT_EQ(heard.signals[static_cast<std::size_t>(80 * kRate_hz)], EcgSignal::kGood);
    const Score after = score(heard, h.beats_s, 72.0, kTo_s);
    EXPECT_LT(after.rms_s, 0.005) << first_falls;
    EXPECT_EQ(heard.beats.back().lead, first_falls ? 1 : 0);
  }
}

TEST(LeadPair, TwoLeadsThatFellOffInterruptOnceAndComeBack) {
  Heart h = heart(5);
  for (std::size_t i = 25200; i < 28800; ++i) h.first[i] = h.second[i] = kNone;
  const Heard heard = listen(h.first, h.second);
  EXPECT_EQ(heard.interruptions, 1U);
  EXPECT_EQ(heard.signals[27000], EcgSignal::kLeadOff);
  EXPECT_EQ(score(heard, h.beats_s, kFrom_s, 69.8).missed, 0);
  EXPECT_EQ(score(heard, h.beats_s, 70.2, 79.8).extra, 0);
  EXPECT_EQ(score(heard, h.beats_s, 83.0, kTo_s).missed, 0);
}

TEST(LeadPair, ASecondLeadMayComeLater) {
  Heart h = heart(6);
  for (std::size_t i = 0; i < 18000; ++i) h.second[i] = kNone;
  for (std::size_t i = 36000; i < h.first.size(); ++i) h.first[i] = kNone;
  const Score s = score(listen(h.first, h.second), h.beats_s, kFrom_s, kTo_s);
  EXPECT_EQ(s.missed + s.extra, 0);
}

// Arcs, as large as the beats and larger, in stretches of one lead.
void add_arcs(std::vector<float>& mV, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(generator);
  };
  for (double burst_s = 30.0; burst_s < 140.0; burst_s += 20.0) {
    for (double at_s = burst_s; at_s < burst_s + 10.0; at_s += uniform(0.05, 0.5)) {
      const double height = uniform(0.5, 4.0) * (uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0);
      const double sigma_s = uniform(0.005, 0.02);
      for (std::size_t i = sample(at_s - 0.1); i < sample(at_s + 0.1); ++i) {
        const double x = (static_cast<double>(i) / kRate_hz - at_s) / sigma_s;
        mV[i] += static_cast<float>(height * std::exp(-0.5 * x * x));
      }
    }
  }
}

TEST(LeadPair, ElectrosurgeryInOneLeadHidesNoBeatAndMakesNone) {
  for (const bool in_first : {true, false}) {
    int missed = 0;
    int extra = 0;
    int believed = 0;
    int alone_wrong = 0;
    for (std::uint64_t seed = 10; seed < 14; ++seed) {
      Heart h = heart(seed, 60.0 + 10.0 * static_cast<double>(seed - 10));
      add_arcs(in_first ? h.first : h.second, seed);
      const Score s = score(listen(h.first, h.second), h.beats_s, kFrom_s, kTo_s);
      missed += s.missed;
      extra += s.extra;
      believed += s.believed;
      const std::vector<float> none(h.first.size(), kNone);
      const Score alone = score(listen(in_first ? h.first : h.second, none), h.beats_s, kFrom_s, kTo_s);
      alone_wrong += alone.missed + alone.extra;
    }
    EXPECT_GT(alone_wrong, 60) << "the arcs hide nothing";
    EXPECT_LE(missed, 4) << in_first;
    EXPECT_LE(extra, 8) << in_first;
    EXPECT_LE(believed, 2) << in_first;
  }
}

// A lead that swings from rail to rail says nothing, and is not waited for.
TEST(LeadPair, ALeadThatSwingsFromRailToRailHidesNoBeat) {
  for (const bool in_first : {true, false}) {
    Heart h = heart(20);
    std::vector<float>& lead = in_first ? h.first : h.second;
    std::mt19937_64 generator(21);
    float level = 5.0F;
    for (std::size_t i = 20000; i < 45000; ++i) {
      if (generator() % 100 == 0) level = -level;
      lead[i] = level;
    }
    const Score s = score(listen(h.first, h.second), h.beats_s, kFrom_s, kTo_s);
    EXPECT_LE(s.missed, 1) << in_first;
    EXPECT_LE(s.extra, 2) << in_first;
    EXPECT_EQ(s.believed, 0) << in_first;
  }
}

// Of a small lead some beats are not found: the other has them, and is believed the more the oftener it is alone.
TEST(LeadPair, ABeatThatOneLeadHasNotIsDoubtfulUntilItOftenHasNone) {
  Heart h = heart(30);
  std::vector<double> alone_s;
  for (std::size_t k = 40; k < h.beats_s.size(); k += 4) {
    alone_s.push_back(h.beats_s[k]);
    const auto peak = static_cast<std::size_t>((h.beats_s[k] + kLater_s) * kRate_hz);
    for (std::size_t i = peak - 30; i < peak + 30 && i < h.second.size(); ++i) h.second[i] = 0.0F;
  }
  const Heard heard = listen(h.first, h.second);
  EXPECT_EQ(score(heard, h.beats_s, kFrom_s, kTo_s).missed, 0);
  std::vector<double> confidences;
  for (const LeadBeat& beat : heard.beats) {
    for (const double t : alone_s) {
      if (std::abs(time_s(beat) - t) < 0.1) confidences.push_back(beat.peak.confidence);
    }
  }
  ASSERT_GT(confidences.size(), 20U);
  EXPECT_LT(confidences.front(), 0.9);
  EXPECT_GT(confidences.back(), confidences.front() + 0.08);
}

// A lead whose T waves are taken for beats now and then.
TEST(LeadPair, WhatOnlyOneLeadTellsSoonAfterABeatIsNotBelieved) {
  Heart h = heart(40, 60.0);
  std::mt19937_64 generator(41);
  for (std::size_t k = 30; k < h.beats_s.size(); ++k) {
    if (generator() % 3 != 0) continue;
    // A copy of the complex, where the T wave is.
    const auto from = static_cast<std::size_t>((h.beats_s[k] - 0.05) * kRate_hz);
    const auto to = static_cast<std::size_t>((h.beats_s[k] + 0.30) * kRate_hz);
    for (std::size_t i = 0; i < 45 && to + i < h.second.size(); ++i) h.second[to + i] = h.second[from + i];
  }
  const std::vector<float> none(h.first.size(), kNone);
  ASSERT_GT(score(listen(h.second, none), h.beats_s, kFrom_s, kTo_s).extra, 15);
  const Score s = score(listen(h.first, h.second), h.beats_s, kFrom_s, kTo_s);
  EXPECT_EQ(s.missed, 0);
  EXPECT_LE(s.extra, 8);
  EXPECT_EQ(s.believed, 0);
}

TEST(LeadPair, BeatsComeInOrderOfTimeAndNoNearerThanVentriclesContract) {
  std::mt19937_64 generator(50);
  std::normal_distribution<float> noise(0.0F, 0.4F);
  Heart h = heart(51, 150.0);
  for (std::size_t i = 0; i < h.first.size(); ++i) {
    h.first[i] += noise(generator);
    h.second[i] += noise(generator);
  }
  const Heard heard = listen(h.first, h.second);
  ASSERT_GT(heard.beats.size(), 100U);
  for (std::size_t i = 1; i < heard.beats.size(); ++i) {
    EXPECT_GE(heard.beats[i].peak.time - heard.beats[i - 1].peak.time, LeadAgreementSettings{}.refractory);
    EXPECT_GE(heard.beats[i].peak.detected_at, heard.beats[i - 1].peak.detected_at);
  }
  EXPECT_LT(score(heard, h.beats_s, 0.0, 150.0).largest_delay_s, 1.2);
}

// A wide beat in both leads is premature, whichever lead gives its time; each lead has its own usual shape.
// Noise that is always there is no disturbance, but no lead is good in it: what it misses tells nothing against the
// other.
TEST(LeadPair, ALeadInSteadyNoiseThatComesNearToItsBeatsSpoilsNothing) {
  Heart h = heart(62);
  std::mt19937 generator(620);
  std::normal_distribution<float> noise(0.0F, 0.12F);
  for (float& mV : h.second) mV += noise(generator);
  const Heard heard = listen(h.first, h.second);
  const Score both = score(heard, h.beats_s, 20.0, 140.0);
  EXPECT_EQ(both.missed, 0);
  EXPECT_EQ(both.extra, 0);
  const auto pair = std::make_unique<LeadPair>();
  int noisy = 0, told = 0;
  for (std::size_t i = 0; i < h.first.size(); ++i) {
    const Instant t(from_seconds(static_cast<double>(i) / kRate_hz));
    static_cast<void>(pair->push(t, h.first[i], h.second[i]));
    if (i < sample(40.0)) continue;
    ++told;
    noisy += pair->signal(1) == EcgSignal::kNoisy ? 1 : 0;
    EXPECT_EQ(pair->signal(0), EcgSignal::kGood);
  }
  EXPECT_GT(noisy, told * 9 / 10);
}

TEST(LeadPair, ClassesGoByTheShapeInTheLeadThatGivesTheTime) {
  Heart h = heart(60);
  std::vector<double> wide_s;
  for (std::size_t k = 30; k + 1 < h.beats_s.size(); k += 9) {
    const double at_s = h.beats_s[k];
    wide_s.push_back(at_s);
    for (std::size_t i = sample(at_s - 0.2); i < sample(at_s + 0.2); ++i) {
      const double x = static_cast<double>(i) / kRate_hz - at_s;
      h.first[i] = static_cast<float>(0.2 * h.first[i] - 1.8 * std::exp(-0.5 * std::pow(x / 0.045, 2)));
      h.second[i] = static_cast<float>(0.2 * h.second[i] + 1.2 * std::exp(-0.5 * std::pow((x - kLater_s) / 0.045, 2)));
    }
  }
  for (std::size_t i = 100 * static_cast<std::size_t>(kRate_hz); i < h.first.size(); ++i) h.first[i] = kNone;
  const auto finder = std::make_unique<BeatFinder>();
  std::vector<RPeak> beats;
  for (std::size_t i = 0; i < h.first.size(); ++i) {
    const Instant t(from_seconds(static_cast<double>(i) / kRate_hz));
    if (const auto beat = finder->push(t, h.first[i], h.second[i])) beats.push_back(*beat);
  }
  int premature = 0;
  int wrong = 0;
  for (const RPeak& beat : beats) {
    const double t = to_seconds(beat.time.time_since_epoch());
    if (t < 45.0) continue;
    const bool wide = std::any_of(wide_s.begin(), wide_s.end(), [&](double w) { return std::abs(t - w) < 0.1; });
    premature += wide && beat.beat_class == BeatClass::kPremature ? 1 : 0;
    wrong += wide != (beat.beat_class == BeatClass::kPremature) ? 1 : 0;
  }
  EXPECT_GE(premature, 11);
  EXPECT_LE(wrong, 2);
}

}  // namespace
}  // namespace perimap::test
