// Beats and how well they were found, as text, as JSON and as a table.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/evaluation/ecg/beat_score.hpp"
#include "daemon/evaluation/ecg/ecg_analysis.hpp"

namespace perimap {

// time_s,class,confidence,detected_at_s
[[nodiscard]] std::string beat_rows(const EcgAnalysis& analysis);

[[nodiscard]] std::string to_text(const EcgAnalysis& analysis, const PredictionErrors& errors);
[[nodiscard]] nlohmann::json to_json(const EcgAnalysis& analysis, const PredictionErrors& errors);

// `left_out`: annotations of the reference that are no beats.
[[nodiscard]] std::string to_text(const BeatScore& score, std::size_t left_out);
[[nodiscard]] nlohmann::json to_json(const BeatScore& score, std::size_t left_out);

}  // namespace perimap
