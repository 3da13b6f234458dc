// Electrosurgery, and what a lead shows whose electrode is off: disturbances of a stretch of an ECG.
#pragma once

#include <cstddef>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "made_lead.hpp"

namespace perimap::test {

// Puts a disturbance in the place of samples begin to end of the lead, or on top of them; what recovers slowly goes on
// behind the end.
using Disturb = std::function<void(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator)>;

// Bell-shaped and biphasic waves of 0.5 to 4 mV, like QRS complexes, 50 to 500 ms apart.
void arcs(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator);
// The line is at one rail or the other, or with `any_level` anywhere between them, for so long each.
[[nodiscard]] Disturb rails(double shortest_s, double longest_s, bool any_level);
// White noise of 1 to 6 mV, cut at 5 mV.
void wide_band(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator);
// Nothing but the converter's last bits, and a line that comes back exponentially within about a second.
void blanking(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator);
// Mains and a slow drift, and no heart.
void hum_and_drift(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator);
// The line of an amplifier without a patient.
void still(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator);

struct DisturbedStretches {
  std::string name;
  Disturb disturb;
  double shortest_s;
  double longest_s;
};

// Four kinds of bursts, 1 to 20 s, and five of leads that are off, 5 to 30 s.
[[nodiscard]] std::vector<DisturbedStretches> electrosurgery();
[[nodiscard]] std::vector<DisturbedStretches> leads_off();

}  // namespace perimap::test
