// What received samples came to, as text and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/evaluation/report/samples_report.hpp"

namespace perimap {

[[nodiscard]] std::string to_text(const SamplesReport& report);
// Without the recording's name.
[[nodiscard]] nlohmann::json to_json(const SamplesReport& report);

}  // namespace perimap
