// The files of an experiment in a folder: the table (CSV, JSON), the figures (PNG, SVG, CSV) and one HTML page.
#pragma once

#include <filesystem>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/evaluation/experiment/experiment.hpp"
#include "daemon/evaluation/traces/trace_experiment.hpp"

namespace perimap {

// All that experiment `number` (1 to 3) writes.
[[nodiscard]] std::vector<std::filesystem::path> experiment_files(int number, const std::filesystem::path& folder);

// Before the trials, which may take hours: makes the folder if needed, and tries whether each of the files can be
// written.
[[nodiscard]] Expected<void> prepare_experiment_files(int number, const std::filesystem::path& folder);

[[nodiscard]] Expected<void> write_files(const Experiment& experiment, const std::filesystem::path& folder);
[[nodiscard]] Expected<void> write_files(const TraceExperiment& experiment, const std::filesystem::path& folder);

}  // namespace perimap
