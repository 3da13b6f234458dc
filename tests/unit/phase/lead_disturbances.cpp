#include "lead_disturbances.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace perimap::test {
namespace {

double uniform(double from, double to, std::mt19937_64& generator) {
  return std::uniform_real_distribution<double>(from, to)(generator);
}

}  // namespace

void arcs(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator) {
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

Disturb rails(double shortest_s, double longest_s, bool any_level) {
  return [=](MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator) {
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

void wide_band(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator) {
  std::normal_distribution<double> noise(0.0, uniform(1.0, 6.0, generator));
  for (std::size_t i = begin; i < end; ++i) {
    lead.mV[i] = static_cast<float>(std::clamp(static_cast<double>(lead.mV[i]) + noise(generator), -5.0, 5.0));
  }
}

void blanking(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator) {
  std::normal_distribution<double> bits(0.0, 0.3);
  const double time_s = uniform(0.3, 1.2, generator);
  const double off_mV = uniform(-4.0, 4.0, generator);
  for (std::size_t i = begin; i < end; ++i) lead.mV[i] = static_cast<float>(0.005 * std::round(bits(generator)));
  for (std::size_t i = end; i < lead.mV.size(); ++i) {
    lead.mV[i] += static_cast<float>(off_mV * std::exp(-static_cast<double>(i - end) / lead.rate_hz / time_s));
  }
}

void hum_and_drift(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator) {
  const double amplitude_mV = uniform(0.3, 2.0, generator);
  const double frequency_hz = uniform(49.0, 61.0, generator);
  for (std::size_t i = begin; i < end; ++i) {
    const double t = 2.0 * std::numbers::pi * static_cast<double>(i - begin) / lead.rate_hz;
    lead.mV[i] = static_cast<float>(amplitude_mV * std::sin(frequency_hz * t) + 3.0 * std::sin(0.13 * t));
  }
}

void still(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator) {
  std::normal_distribution<double> bits(0.0, 1.0);
  for (std::size_t i = begin; i < end; ++i) lead.mV[i] = static_cast<float>(0.004 * std::round(bits(generator)));
}

std::vector<DisturbedStretches> electrosurgery() {
  return {{"arcs", arcs, 1.0, 20.0},
          {"rail to rail", rails(0.003, 0.3, false), 1.0, 20.0},
          {"noise of 1 to 6 mV", wide_band, 1.0, 20.0},
          {"blanking, slow recovery", blanking, 1.0, 20.0}};
}

std::vector<DisturbedStretches> leads_off() {
  return {{"rail to rail", rails(0.02, 0.8, false), 5.0, 30.0},
          {"steps", rails(0.1, 1.5, true), 5.0, 30.0},
          {"white noise", wide_band, 5.0, 30.0},
          {"mains and drift", hum_and_drift, 5.0, 30.0},
          {"flat to 4 uV", still, 5.0, 30.0}};
}

}  // namespace perimap::test
