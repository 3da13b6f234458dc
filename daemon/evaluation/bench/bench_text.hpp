// The report of a benchmark: for a terminal, for machines, and as a page.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/evaluation/bench/bench.hpp"

namespace perimap::bench {

[[nodiscard]] std::string to_table(const BenchReport& report);
[[nodiscard]] nlohmann::ordered_json to_json(const BenchReport& report);
// One self-contained page.
[[nodiscard]] std::string to_html(const BenchReport& report);

}  // namespace perimap::bench
