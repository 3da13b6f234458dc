// A patient for the tests of the decision on beats: complexes that are made, given to it as if they had been measured.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "core/phase/beat_decision.hpp"
#include "core/phase/ecg_filter.hpp"

namespace perimap::test {

inline double seconds(Instant t) { return to_seconds(t.time_since_epoch()); }
inline Instant at(double t_s) { return Instant(from_seconds(t_s)); }

// The slope of a wave of that height and width in steps of 5 ms.
inline QrsShape wave(double height, double width, double middle = 18.0) {
  QrsShape s;
  s.points = 28;
  for (int i = 0; i < s.points; ++i) {
    const double x = (i - middle) / width;
    s.slope[static_cast<std::size_t>(i)] = static_cast<float>(-height * x * std::exp(-0.5 * x * x));
  }
  return s;
}
inline const QrsShape kBeat = wave(1.0, 2.5);
inline const QrsShape kWide = wave(1.0, 7.0, 12.0);

// As like one shape as the correlation says, and otherwise like another.
inline QrsShape between(const QrsShape& one, QrsShape other, double correlation, double gain = 1.0) {
  const double along = match(other, one).gain;
  for (int i = 0; i < other.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    other.slope[k] -= static_cast<float>(along) * one.slope[k];
  }
  const double across = std::sqrt(1.0 - correlation * correlation) * root_mean_square(one) / root_mean_square(other);
  QrsShape shape = one;
  for (int i = 0; i < shape.points; ++i) {
    const auto k = static_cast<std::size_t>(i);
    shape.slope[k] = static_cast<float>(
        gain * (correlation * static_cast<double>(one.slope[k]) + across * static_cast<double>(other.slope[k])));
  }
  return shape;
}
inline QrsShape like_beat(double correlation, double gain = 1.0) { return between(kBeat, kWide, correlation, gain); }

// A shape that is like no other number's.
inline QrsShape strange_shape(unsigned number) {
  std::mt19937 generator(number);
  std::normal_distribution<float> normal(0.0F, 0.4F);
  QrsShape s;
  s.points = 28;
  for (int i = 0; i < s.points; ++i) s.slope[static_cast<std::size_t>(i)] = normal(generator);
  return s;
}

using Change = std::function<void(QrsCandidate&)>;
inline void none(QrsCandidate&) {}

// A patient whose complexes are measured so long after their peak.
struct Patient {
  static constexpr double kMeasured_s = 0.095;

  // Levels of a line with beats, and of that noise between them.
  explicit Patient(double noise_mV = 0.005, double height_mV = 1.0) {
    EcgFilter filter;
    filter.restart(from_seconds(1.0 / 250.0));
    std::mt19937_64 generator(0x58d1e0b37a94c62fU);
    std::normal_distribution<double> noise(0.0, noise_mV);
    for (int i = 0; i < 15 * 250; ++i) {
      const double x = std::remainder(i / 250.0 - 0.4, 0.8) / 0.012;
      filter.push(at(i / 250.0), height_mV * std::exp(-0.5 * x * x) + noise(generator), false);
      levels.follow(filter, 0.0, false);
    }
    decision.restart(at(0.0));
  }

  [[nodiscard]] QrsCandidate complex(double at_s, const Change& change = none) const {
    QrsCandidate c;
    c.time = at(at_s);
    c.deviation = std::chrono::milliseconds(1);
    c.shape = kBeat;
    c.energy = levels.top_energy();
    c.sharpness = levels.top_sharpness();
    c.slope = 0.8;
    c.upward = 1.0;
    change(c);
    return c;
  }
  void run(double until_s) {
    for (; now_s < until_s; now_s += 0.004) {
      decision.decide(at(now_s), false);
      while (const auto peak = decision.pop()) told.push_back(*peak);
    }
  }
  // A complex at that time, and what is decided until it is measured.
  void see(double at_s, const Change& change = none) {
    run(at_s + kMeasured_s);
    decision.consider(complex(at_s, change), CandidateSettings{}.one_complex, at(now_s));
    last_s = at_s;
  }
  // So many usual beats, the first a cycle after the last complex.
  void beats(int count, double cycle_s = 0.8, const Change& change = none) {
    for (int i = 0; i < count; ++i) see(last_s + cycle_s, change);
  }
  // Complexes of a beat's size and of all shapes.
  void strangers(int count, double apart_s, double size = 1.0) {
    for (int i = 0; i < count; ++i) {
      see(last_s + apart_s, [&](QrsCandidate& c) {
        c.shape = strange_shape(number++);
        c.energy *= size;
        c.sharpness *= size;
      });
    }
  }
  [[nodiscard]] std::optional<RPeak> told_at(double at_s) {
    run(at_s + 1.2);
    const auto peak =
        std::find_if(told.begin(), told.end(), [&](const RPeak& p) { return std::abs(seconds(p.time) - at_s) < 0.03; });
    return peak == told.end() ? std::nullopt : std::optional(*peak);
  }
  [[nodiscard]] double delay_s(double at_s) {
    const auto peak = told_at(at_s);
    return peak ? to_seconds(peak->detected_at - peak->time) : -1.0;
  }
  [[nodiscard]] double confidence(double at_s) {
    const auto peak = told_at(at_s);
    return peak ? peak->confidence : -1.0;
  }

  DecisionSettings settings;
  EcgLevels levels{EcgLevelSettings{}};
  BeatDecision decision{settings, levels};
  std::vector<RPeak> told;
  double now_s = 0.0;
  double last_s = 0.2;
  unsigned number = 1;
};

// A patient whose beats have been known for long.
struct Known : Patient {
  explicit Known(int count = 40, double cycle_s = 0.8, double noise_mV = 0.005) : Patient(noise_mV) {
    beats(count, cycle_s);
  }
};

inline Change shaped(const QrsShape& shape) {
  return [=](QrsCandidate& c) { c.shape = shape; };
}
inline Change weaker(double by) {
  return [=](QrsCandidate& c) { c.energy *= by, c.sharpness *= by; };
}

// By itself, among the patient's levels.
inline double by_itself(const Patient& patient, const QrsCandidate& candidate) {
  ComplexContext context;
  context.top_energy = patient.levels.top_energy();
  context.top_sharpness = patient.levels.top_sharpness();
  context.quiet_energy = patient.levels.quiet();
  return log_odds(evidence_of(candidate, context), kFittedWeights.complex);
}

// So large that it is a disturbance at once, of weight one; a few milliseconds after its time.
struct Disturbed : Known {
  explicit Disturbed(int count, double after_s = 0.8) {
    familiar_s = last_s;
    for (int i = 0; i < count; ++i) {
      run(familiar_s + after_s + Patient::kMeasured_s);
      decision.consider(
          complex(familiar_s + after_s + 0.07 * i,
                  [&](QrsCandidate& c) { c.energy *= 5.0, c.shape = strange_shape(static_cast<unsigned>(i) + 50); }),
          CandidateSettings{}.one_complex, at(now_s));
    }
    disturbed_s = familiar_s + after_s + 0.07 * (count - 1);
    decision.restart(at(now_s));  // what waits is lost: no other disturbance comes of it
  }
  double familiar_s = 0.0;
  double disturbed_s = 0.0;
};

}  // namespace perimap::test
