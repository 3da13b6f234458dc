// The tables of docs/evidence/ecg.md that are made of records which the project does not carry, or of made leads.
// Each is printed as it stands there.
#pragma once

#include <cstdint>
#include <vector>

#include "recorded_lead.hpp"

namespace perimap::test {

// F1, confidences, delays, of each part and of each record.
void print_records(const std::vector<RecordedLead>& records);
// From each R time to the local peak of the signal.
void print_peak_times(const std::vector<RecordedLead>& records);
// How many ventricular beats are classed premature, and how many usual ones.
void print_ventricular(const std::vector<RecordedLead>& records);
// The next interval as predicted.
void print_prediction(const std::vector<RecordedLead>& records);
// Sessions of 12 s that begin anywhere.
void print_starts(const std::vector<RecordedLead>& records);
// Bursts of electrosurgery and leads that come off, on stretches of 200 s.
void print_disturbed(const std::vector<RecordedLead>& records, std::uint64_t seed);
// Two leads, of which one or both are disturbed, on stretches of 120 s.
void print_two_leads(const std::vector<RecordedLead>& records, std::uint64_t seed);
// So many leads that are made of bell-shaped waves. Whether the detector keeps to its bounds.
[[nodiscard]] bool print_made(int draws, std::uint64_t seed);
// So many leads of paced hearts with ventricular beats. Likewise.
[[nodiscard]] bool print_paced(int draws, std::uint64_t seed);

}  // namespace perimap::test
