// The ECG that a session is simulated with, and when its heart beats.
#pragma once

#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/simulator/ecg_script.hpp"
#include "drivers/standins/simulator/simulation_settings.hpp"

namespace perimap {

// The error names the record, and what it holds.
[[nodiscard]] Expected<EcgScript> session_ecg(const SimulationSettings& settings);

// R peaks of a session that begins at `start`, with a margin of beats before and after it.
[[nodiscard]] std::vector<Instant> r_peaks_of(const EcgScript& script, Instant start, Duration duration);

}  // namespace perimap
