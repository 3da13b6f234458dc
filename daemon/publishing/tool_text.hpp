// How far a tool is from the surface, in words and as JSON.
#pragma once

#include <perimap_tool.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <perimap_tool_client.hpp>
#include <string>
#include <string_view>

namespace perimap {

[[nodiscard]] std::string_view tool_state_name(std::uint8_t state) noexcept;    // "good"
[[nodiscard]] std::string_view tool_reason_name(std::uint8_t reason) noexcept;  // "beyond_edge"

// At an instant. "instrument/probe 3.2 +- 0.4 mm, -12 mm/s", "pointer TOUCHES, 0.1 +- 0.4 mm, 0 mm/s", "pointer: not
// seen".
[[nodiscard]] std::string tool_words(std::string_view name, const client::ToolAtInstant& at);
// Of the instant of the sample, however long ago.
[[nodiscard]] std::string tool_words(const perimap_ToolDistance& tool);
// What is not known is null.
[[nodiscard]] nlohmann::ordered_json tool_json(const perimap_ToolDistance& tool);

}  // namespace perimap
