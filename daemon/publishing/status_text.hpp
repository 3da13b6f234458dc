// A status in words: for machines, and on one line.
#pragma once

#include <perimap.h>

#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace perimap {

// What was counted, of the releases those of its own stream; of the sources and the recording nothing.
[[nodiscard]] nlohmann::ordered_json counts_json(const perimap_Status& status);
// Of the releases alone.
[[nodiscard]] nlohmann::ordered_json stream_counts_json(const perimap_Status& status);

// Names are those of perimap.idl without their prefix, times in ms. Values may come from outside: none is trusted as an
// index.
[[nodiscard]] nlohmann::ordered_json status_json(const perimap_Status& status,
                                                 std::span<const perimap_StageLatency> stages,
                                                 std::span<const perimap_SourceStatus> sources);

// What it publishes, and which sources are not well. With the sequences that the status itself has.
[[nodiscard]] std::string status_line(const perimap_Status& status);

// With the sequences that the status itself has: privileges, sources and stages, a line each.
[[nodiscard]] nlohmann::ordered_json full_status_json(const perimap_Status& status);

// What it says of its own stream alone.
[[nodiscard]] nlohmann::ordered_json stream_status_json(const perimap_Status& status);

}  // namespace perimap
