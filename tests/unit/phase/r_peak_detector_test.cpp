#include "core/phase/r_peak_detector.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace perimap {
namespace {

struct EcgRecord {
  std::vector<double> t_s;
  std::vector<double> mV;
  std::vector<double> beats_s;
};

EcgRecord load(const std::string& number) {
  EcgRecord record;
  const std::string stem = PERIMAP_TEST_DATA "/mitbih/" + number + "_60s";
  std::string line;
  std::ifstream signal(stem + ".csv");
  std::getline(signal, line);
  while (std::getline(signal, line)) {
    const auto comma = line.find(',');
    record.t_s.push_back(std::stod(line.substr(0, comma)));
    record.mV.push_back(std::stod(line.substr(comma + 1)));
  }
  std::ifstream beats(stem + "_beats.csv");
  std::getline(beats, line);
  while (std::getline(beats, line)) record.beats_s.push_back(std::stod(line.substr(0, line.find(','))));
  return record;
}

template <class Value>
std::vector<RPeak> detect(const EcgRecord& record, Value&& value) {
  const auto detector = std::make_unique<RPeakDetector>();
  std::vector<RPeak> peaks;
  for (std::size_t i = 0; i < record.t_s.size(); ++i) {
    const auto peak = detector->push(Instant(from_seconds(record.t_s[i])), static_cast<float>(value(i)));
    if (peak) peaks.push_back(*peak);
  }
  while (const auto peak = detector->flush()) peaks.push_back(*peak);
  return peaks;
}

std::vector<RPeak> detect(const EcgRecord& record, double gain = 1.0) {
  return detect(record, [&](std::size_t i) { return gain * record.mV[i]; });
}

double seconds(Instant t) { return to_seconds(t.time_since_epoch()); }

// Pairs within 150 ms, the tolerance of ANSI/AAMI EC57.
struct Score {
  int found = 0;
  int missed = 0;
  int extra = 0;
};

Score score(const std::vector<double>& beats_s, const std::vector<RPeak>& peaks) {
  Score result;
  std::vector<bool> used(peaks.size(), false);
  for (const double beat : beats_s) {
    std::size_t nearest = peaks.size();
    for (std::size_t i = 0; i < peaks.size(); ++i) {
      if (used[i] || std::abs(seconds(peaks[i].time) - beat) > 0.150) continue;
      if (nearest == peaks.size() ||
          std::abs(seconds(peaks[i].time) - beat) < std::abs(seconds(peaks[nearest].time) - beat)) {
        nearest = i;
      }
    }
    if (nearest == peaks.size()) {
      ++result.missed;
    } else {
      used[nearest] = true;
      ++result.found;
    }
  }
  result.extra = static_cast<int>(std::count(used.begin(), used.end(), false));
  return result;
}

class EveryExcerpt : public testing::TestWithParam<const char*> {};

TEST_P(EveryExcerpt, AtMostOneBeatIsWrong) {
  const EcgRecord record = load(GetParam());
  ASSERT_GT(record.beats_s.size(), 50U);
  const Score result = score(record.beats_s, detect(record));
  EXPECT_LE(result.missed + result.extra, 1);
}

INSTANTIATE_TEST_SUITE_P(MitBih, EveryExcerpt, testing::Values("100", "105", "119"));

TEST(RPeakDetector, TimeIsThatOfTheLocalPeak) {
  const EcgRecord record = load("100");
  double squares = 0.0;
  const auto peaks = detect(record);
  for (const RPeak& peak : peaks) {
    // The highest sample within 60 ms of the nearest reference beat.
    const double t = seconds(peak.time);
    const double beat = *std::min_element(record.beats_s.begin(), record.beats_s.end(),
                                          [&](double a, double b) { return std::abs(a - t) < std::abs(b - t); });
    std::size_t highest = record.t_s.size();
    for (std::size_t i = 0; i < record.t_s.size(); ++i) {
      if (std::abs(record.t_s[i] - beat) > 0.060) continue;
      if (highest == record.t_s.size() || record.mV[i] > record.mV[highest]) highest = i;
    }
    squares += std::pow(t - record.t_s[highest], 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(peaks.size())), 0.002);
}

TEST(RPeakDetector, KnowsABeatSoonAfterItsPeak) {
  std::vector<Duration> delays;
  for (const RPeak& peak : detect(load("100"))) {
    EXPECT_GE(peak.detected_at, peak.time);
    delays.push_back(peak.detected_at - peak.time);
  }
  std::nth_element(delays.begin(), delays.begin() + static_cast<std::ptrdiff_t>(delays.size() / 2), delays.end());
  EXPECT_LE(delays[delays.size() / 2], std::chrono::milliseconds(150));
}

TEST(RPeakDetector, NeitherPolarityNorGainMatters) {
  const EcgRecord record = load("100");
  const auto expected = detect(record);
  for (const double gain : {-1.0, 0.1, 10.0, -0.1}) {
    const auto peaks = detect(record, gain);
    ASSERT_EQ(peaks.size(), expected.size()) << "gain " << gain;
    for (std::size_t i = 0; i < peaks.size(); ++i) {
      EXPECT_NEAR(seconds(peaks[i].time), seconds(expected[i].time), 1e-4) << "gain " << gain;
    }
  }
}

TEST(RPeakDetector, BaselineWanderAndMainsDoNotDisturb) {
  const EcgRecord record = load("100");
  const auto peaks = detect(record, [&](std::size_t i) {
    const double t = record.t_s[i];
    return record.mV[i] + 0.8 * std::sin(2.0 * std::numbers::pi * 0.25 * t) +
           0.15 * std::sin(2.0 * std::numbers::pi * 50.0 * t);
  });
  const Score result = score(record.beats_s, peaks);
  EXPECT_EQ(result.missed, 0);
  EXPECT_EQ(result.extra, 0);
}

// A synthetic lead: P, QRS and T as Gaussian bumps, R exactly at the beat. T as tall as R.
EcgRecord synthetic(double rate_hz, double rr_s, double duration_s, double t_wave_mV) {
  EcgRecord record;
  for (double beat = 0.537123; beat < duration_s - 0.3; beat += rr_s) record.beats_s.push_back(beat);
  for (int i = 0; i < static_cast<int>(duration_s * rate_hz); ++i) {
    const double t = i / rate_hz;
    double mV = 0.0;
    for (const double beat : record.beats_s) {
      const auto bump = [&](double height, double at, double width) {
        mV += height * std::exp(-0.5 * std::pow((t - beat - at) / width, 2));
      };
      bump(0.15, -0.16, 0.02);
      bump(1.0, 0.0, 0.012);
      bump(-0.25, 0.03, 0.012);
      bump(t_wave_mV, 0.28, 0.045);
    }
    record.t_s.push_back(t);
    record.mV.push_back(mV);
  }
  return record;
}

TEST(RPeakDetector, WorksAtEveryRateAndSeesBetweenTheSamples) {
  for (const double rate : {100.0, 125.0, 250.0, 500.0, 1000.0}) {
    const EcgRecord record = synthetic(rate, 0.8137, 20.0, 0.3);
    const auto peaks = detect(record);
    const Score result = score(record.beats_s, peaks);
    EXPECT_EQ(result.missed, 0) << rate;
    EXPECT_EQ(result.extra, 0) << rate;
    ASSERT_EQ(peaks.size(), record.beats_s.size()) << rate;
    std::vector<double> errors;
    for (std::size_t i = 0; i < peaks.size(); ++i) errors.push_back(seconds(peaks[i].time) - record.beats_s[i]);
    const auto [least, most] = std::minmax_element(errors.begin(), errors.end());
    EXPECT_LT(*most - *least, 0.3 / rate) << rate;
    EXPECT_LT(std::abs(*most), 0.005) << rate;
  }
}

TEST(RPeakDetector, TallTWavesAreNotBeats) {
  const EcgRecord record = synthetic(360.0, 0.85, 30.0, 1.0);
  const Score result = score(record.beats_s, detect(record));
  EXPECT_EQ(result.missed, 0);
  EXPECT_EQ(result.extra, 0);
}

TEST(RPeakDetector, FollowsAChangeOfGain) {
  const EcgRecord record = load("100");
  const auto peaks = detect(record, [&](std::size_t i) { return (i < 10000 ? 1.0 : 0.1) * record.mV[i]; });
  std::vector<double> later;
  for (const double beat : record.beats_s) {
    if (beat > record.t_s[10000] + 8.0) later.push_back(beat);
  }
  EXPECT_EQ(score(later, peaks).missed, 0);
}

TEST(RPeakDetector, AFlatLineHasNoBeats) {
  const EcgRecord record = load("100");
  EXPECT_TRUE(detect(record, [](std::size_t) { return 0.37; }).empty());
  std::mt19937 generator(5);
  std::normal_distribution<double> noise(0.0, 0.4);
  EXPECT_TRUE(detect(record, [&](std::size_t) { return 0.005 * std::round(noise(generator)); }).empty());
}

TEST(RPeakDetector, SaysThatTheLineIsFlat) {
  const EcgRecord record = load("100");
  const auto detector = std::make_unique<RPeakDetector>();
  for (std::size_t i = 0; i < 7200; ++i) {
    const bool flat = i >= 3600 && i < 5400;
    static_cast<void>(
        detector->push(Instant(from_seconds(record.t_s[i])), flat ? 5.12F : static_cast<float>(record.mV[i])));
    if (i == 3599) {
      EXPECT_EQ(detector->signal(), EcgSignal::kGood);
    } else if (i > 3600 + 370) {
      EXPECT_EQ(detector->signal() == EcgSignal::kFlat, flat) << i;
    }
  }
}

TEST(RPeakDetector, PacingSpikesAreNotBeats) {
  const EcgRecord record = load("100");
  for (const double height : {5.0, -5.0}) {
    EcgRecord paced = record;
    for (const double beat : record.beats_s) {
      const auto i = static_cast<std::size_t>((beat - record.t_s.front() - 0.16) * 360.0);  // atrial
      if (i + 1 >= paced.mV.size()) continue;
      paced.mV[i] += height;
      paced.mV[i + 1] += 0.3 * height;
    }
    const Score result = score(record.beats_s, detect(paced));
    EXPECT_EQ(result.missed, 0) << height;
    EXPECT_EQ(result.extra, 0) << height;
  }
}

// A burst hides beats, but must neither invent many nor deafen the detector after it.
TEST(RPeakDetector, HearsAgainAfterElectrosurgery) {
  EcgRecord record = load("100");
  std::mt19937 generator(7);
  std::normal_distribution<double> noise(0.0, 5.0);
  const double begin = record.t_s.front();
  for (std::size_t i = 0; i < record.mV.size(); ++i) {
    const double t = std::fmod(record.t_s[i] - begin, 20.0);
    if (t > 10.0 && t < 12.0) record.mV[i] = std::clamp(record.mV[i] + noise(generator), -5.0, 5.0);
  }
  std::vector<double> outside;
  for (const double beat : record.beats_s) {
    const double t = std::fmod(beat - begin, 20.0);
    if (t < 9.8 || t > 12.4) outside.push_back(beat);
  }
  const auto peaks = detect(record);
  EXPECT_LE(score(outside, peaks).missed, 2);
  EXPECT_LE(score(record.beats_s, peaks).extra, 5);
}

TEST(RPeakDetector, AGainThatRisesOrFallsTenfoldIsFollowed) {
  const EcgRecord record = load("100");
  for (const double factor : {10.0, 0.1}) {
    const auto peaks = detect(record, [&](std::size_t i) { return (i < 10000 ? 1.0 : factor) * record.mV[i]; });
    const Score result = score(record.beats_s, peaks);
    EXPECT_LE(result.missed + result.extra, 6) << factor;
  }
}

TEST(RPeakDetector, GivesNoBeatsWhileTheLeadIsOff) {
  const EcgRecord record = load("100");
  const auto detector = std::make_unique<RPeakDetector>();
  std::vector<RPeak> peaks;
  for (std::size_t i = 0; i < record.t_s.size(); ++i) {
    const Instant t(from_seconds(record.t_s[i]));
    const bool off = i > 8000 && i < 12000;
    if (off) detector->lead_off(t);
    const auto peak = off ? std::nullopt : detector->push(t, static_cast<float>(record.mV[i]));
    if (peak) peaks.push_back(*peak);
  }
  for (const RPeak& peak : peaks) {
    const double t = seconds(peak.time);
    EXPECT_FALSE(t > record.t_s[8000] && t < record.t_s[12000]) << t;
  }
  std::vector<double> later;
  for (const double beat : record.beats_s) {
    if (beat > record.t_s[12000] + 0.3 && beat < record.t_s.back() - 0.3) later.push_back(beat);
  }
  EXPECT_EQ(score(later, peaks).missed, 0);
}

// What detect() tells of a record of which the samples that `missing` names are blank, or not there at all.
template <class Missing>
Score without(const EcgRecord& record, bool blank, Missing&& missing, std::uint64_t* interruptions = nullptr) {
  const auto detector = std::make_unique<RPeakDetector>();
  std::vector<RPeak> peaks;
  for (std::size_t i = 0; i < record.t_s.size(); ++i) {
    if (missing(i) && !blank) continue;
    const float value = missing(i) ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(record.mV[i]);
    const auto peak = detector->push(Instant(from_seconds(record.t_s[i])), value);
    if (peak) peaks.push_back(*peak);
  }
  while (const auto peak = detector->flush()) peaks.push_back(*peak);
  if (interruptions != nullptr) *interruptions = detector->interruptions();
  return score(record.beats_s, peaks);
}

TEST(RPeakDetector, SamplesThatAreMissingNowAndThenHideNoBeat) {
  const EcgRecord record = load("100");
  for (const bool blank : {false, true}) {
    for (const double every_s : {0.5, 1.0, 1.9}) {
      for (const std::size_t length : {1U, 5U, 9U}) {
        const auto every = static_cast<std::size_t>(every_s * 360.0);
        std::uint64_t interruptions = 0;
        const Score result = without(
            record, blank, [&](std::size_t i) { return i % every > 20 && i % every <= 20 + length; }, &interruptions);
        EXPECT_EQ(result.missed + result.extra, 0) << blank << ' ' << every_s << ' ' << length;
        EXPECT_EQ(interruptions, 0U);
      }
    }
  }
}

TEST(RPeakDetector, ABeatIsKnownWhenSamplesSoonAfterItAreMissing) {
  const EcgRecord record = load("100");
  const double begin = record.t_s.front();
  const auto after_a_beat = [&](std::size_t i) {
    for (const double beat : record.beats_s) {
      const double since = record.t_s[i] - beat;
      if (since > 0.060 && since < 0.080 && static_cast<int>(beat - begin) % 4 == 0) return true;
    }
    return false;
  };
  const Score result = without(record, false, after_a_beat);
  EXPECT_EQ(result.missed + result.extra, 0);
}

TEST(RPeakDetector, AStretchThatIsTooLongToBridgeIsAnInterruption) {
  const EcgRecord record = load("100");
  for (const bool blank : {false, true}) {
    for (const std::size_t missing : {9U, 12U}) {
      std::uint64_t interruptions = 0;
      static_cast<void>(without(
          record, blank, [&](std::size_t i) { return i >= 5000 && i < 5000 + missing; }, &interruptions));
      EXPECT_EQ(interruptions, missing == 9U ? 0U : 1U) << blank << ' ' << missing;
    }
  }
  const auto detector = std::make_unique<RPeakDetector>();
  for (std::size_t i = 0; i < 5000; ++i) {
    static_cast<void>(detector->push(Instant(from_seconds(record.t_s[i])), static_cast<float>(record.mV[i])));
  }
  for (std::size_t i = 5000; i < 5020; ++i) {
    EXPECT_FALSE(detector->push(Instant(from_seconds(record.t_s[i])), std::numeric_limits<float>::quiet_NaN()));
  }
  EXPECT_EQ(detector->signal(), EcgSignal::kLeadOff);
}

// Each stretch is forgotten, not what has been learnt before it.
TEST(RPeakDetector, LearnsWhatBeatsLookLikeThoughItIsInterruptedAllTheTime) {
  const EcgRecord record = load("100");
  const Score result = without(record, false, [](std::size_t i) { return i % 540 < 18; });
  EXPECT_GT(result.found, 50) << "an interruption every 1.5 s hides some";
  EXPECT_EQ(result.extra, 0);
}

TEST(RPeakDetector, APeakAmongMissingSamplesIsToldLessSurely) {
  const EcgRecord record = synthetic(360.0, 0.8137, 20.0, 0.3);
  const double beat = record.beats_s[15];
  const auto whole = detect(record);
  const auto detector = std::make_unique<RPeakDetector>();
  std::vector<RPeak> peaks;
  for (std::size_t i = 0; i < record.t_s.size(); ++i) {
    if (std::abs(record.t_s[i] - beat) < 0.011) continue;
    const auto peak = detector->push(Instant(from_seconds(record.t_s[i])), static_cast<float>(record.mV[i]));
    if (peak) peaks.push_back(*peak);
  }
  ASSERT_GT(peaks.size(), 16U);
  EXPECT_NEAR(seconds(peaks[15].time), beat, 0.012);
  EXPECT_GT(to_seconds(peaks[15].deviation), 0.004);
  EXPECT_LT(to_seconds(whole[15].deviation), 0.002);
}

TEST(RPeakDetector, PacingSpikesAreNotBeatsAtAnyRate) {
  for (const double rate : {100.0, 125.0, 200.0, 250.0, 500.0, 1000.0}) {
    for (const double height : {5.0, -5.0, 20.0}) {
      for (const double before : {0.16, 0.05}) {
        EcgRecord record = synthetic(rate, 0.8137, 30.0, 0.3);
        // Of 2 ms; a slow converter takes the mean over its sample.
        for (const double beat : record.beats_s) {
          const auto first = static_cast<std::size_t>((beat - before) * rate);
          const auto samples = static_cast<std::size_t>(std::max(1.0, std::round(0.002 * rate)));
          for (std::size_t i = first; i < first + samples; ++i) record.mV[i] += height * std::min(1.0, 0.002 * rate);
        }
        const auto peaks = detect(record);
        const Score result = score(record.beats_s, peaks);
        EXPECT_EQ(result.missed, 0) << rate << ' ' << height << ' ' << before;
        EXPECT_EQ(result.extra, 0) << rate << ' ' << height << ' ' << before;
        for (std::size_t i = 0; i < std::min(peaks.size(), record.beats_s.size()); ++i) {
          EXPECT_NEAR(seconds(peaks[i].time), record.beats_s[i], 0.008) << rate << ' ' << height << ' ' << before;
        }
      }
    }
  }
}

TEST(RPeakDetector, AnAmplifierAtItsLimitIsFlatThoughItsLastBitIsNot) {
  const EcgRecord record = load("100");
  std::mt19937 generator(3);
  const auto detector = std::make_unique<RPeakDetector>();
  for (std::size_t i = 0; i < 9000; ++i) {
    const bool off = i >= 3600 && i < 7200;
    const double value = off ? 5.115 + 0.005 * static_cast<double>(generator() % 2) : record.mV[i];
    const auto peak = detector->push(Instant(from_seconds(record.t_s[i])), static_cast<float>(value));
    if (off && i > 3600 + 1000) {
      EXPECT_EQ(detector->signal(), EcgSignal::kFlat) << i;
      EXPECT_FALSE(peak);
    }
  }
  EXPECT_EQ(detector->signal(), EcgSignal::kGood);
}

// Of `record` from sample `from` on, at `rate` and with stamps of milliseconds where asked for.
EcgRecord resampled(const EcgRecord& record, double from_s, double to_s, double rate, bool in_milliseconds) {
  EcgRecord result;
  std::size_t i = 0;
  for (int k = 0;; ++k) {
    const double t = from_s + k / rate;
    if (t >= to_s) break;
    while (i + 2 < record.t_s.size() && record.t_s[i + 1] <= t) ++i;
    const double share = (t - record.t_s[i]) / (record.t_s[i + 1] - record.t_s[i]);
    result.t_s.push_back(in_milliseconds ? 1e-3 * std::round(1e3 * t) : t);
    result.mV.push_back((1.0 - share) * record.mV[i] + share * record.mV[i + 1]);
  }
  return result;
}

TEST(RPeakDetector, AnotherRateThanTheFirstStampsTellIsLearnt) {
  const EcgRecord record = load("100");
  const double begin = record.t_s.front();
  const double end = record.t_s.back();
  EcgRecord burst = record;
  for (std::size_t i = 0; i < 20; ++i) burst.t_s[i] = burst.t_s[20] - 0.0005 * static_cast<double>(20 - i);
  EXPECT_EQ(score(record.beats_s, detect(burst)).missed, 0);

  EcgRecord slower = resampled(record, begin, begin + 20.0, 500.0, false);
  const EcgRecord rest = resampled(record, begin + 20.5, end, 100.0, false);
  slower.t_s.insert(slower.t_s.end(), rest.t_s.begin(), rest.t_s.end());
  slower.mV.insert(slower.mV.end(), rest.mV.begin(), rest.mV.end());
  std::vector<double> apart;
  for (const double beat : record.beats_s) {
    if (beat < begin + 19.8 || beat > begin + 23.0) apart.push_back(beat);
  }
  EXPECT_EQ(score(apart, detect(slower)).missed, 0);
}

TEST(RPeakDetector, StampsThatAreRoundedToMillisecondsDelayNothing) {
  const EcgRecord record = load("100");
  for (const double rate : {360.0, 600.0, 720.0, 800.0}) {
    const EcgRecord rounded = resampled(record, record.t_s.front(), record.t_s.back(), rate, true);
    std::vector<Duration> delays;
    const auto peaks = detect(rounded);
    const Score result = score(record.beats_s, peaks);
    EXPECT_EQ(result.missed + result.extra, 0) << rate;
    for (const RPeak& peak : peaks) delays.push_back(peak.detected_at - peak.time);
    const auto middle = delays.begin() + static_cast<std::ptrdiff_t>(delays.size() / 2);
    std::nth_element(delays.begin(), middle, delays.end());
    EXPECT_LT(*middle, std::chrono::milliseconds(105)) << rate;
  }
}

TEST(RPeakDetector, ValuesThatAreNotFiniteAndStampsThatDoNotAdvanceGiveNothing) {
  const auto detector = std::make_unique<RPeakDetector>();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float huge = std::numeric_limits<float>::infinity();
  for (int i = 0; i < 5000; ++i) {
    EXPECT_FALSE(detector->push(from_ns(i * 2'000'000LL), i % 2 == 0 ? nan : huge));
    EXPECT_FALSE(detector->push(from_ns(1), static_cast<float>(i % 97)));
  }
  EXPECT_FALSE(detector->flush());
}

}  // namespace
}  // namespace perimap
