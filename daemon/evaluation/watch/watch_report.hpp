// What `perimap watch` prints.
#pragma once

#include <perimap.h>

#include <string>

#include "core/time/instant.hpp"
#include "daemon/evaluation/watch/watch_statistics.hpp"

namespace perimap {

enum class ReportKind { kInterval, kSummary };

// One line for a person, without its end of line.
[[nodiscard]] std::string report_line(const StreamReport& report);
// Several lines for a person: the end of a watch.
[[nodiscard]] std::string summary_text(const StreamReport& report);
// One JSON object on one line, without its end of line.
[[nodiscard]] std::string report_json(const StreamReport& report, ReportKind kind);
// A whole surface as one JSON object on one line, without its end of line.
[[nodiscard]] std::string surface_json(const perimap_Surface& surface, Instant receipt);

}  // namespace perimap
