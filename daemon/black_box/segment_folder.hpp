// The folder with the segments of a black box.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap::black_box {

// Of "segment-00000012"; nothing of another name.
[[nodiscard]] std::optional<std::uint64_t> number_of_segment(const std::string& name);

// In rising order. Error names the folder.
[[nodiscard]] Expected<std::vector<std::uint64_t>> segment_numbers(const std::filesystem::path& folder);

// What an interrupted beginning has left.
void remove_unfinished_segments(const std::filesystem::path& folder);

// Error names the file. More than any segment has is refused.
[[nodiscard]] Expected<std::string> read_segment_file(const std::filesystem::path& file);

}  // namespace perimap::black_box
