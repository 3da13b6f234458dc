// A field of a table as programs write them: beside spaces, in quotes, as a name in a heading.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace perimap {

// A table with its fields separated by commas and its numbers with points, whatever it was written with: semicolons,
// tabs or spaces between fields, and with the first two decimal commas. What stands where is the same, so that errors
// name the right column. By the first line that is no remark and has a digit.
[[nodiscard]] std::string with_commas(std::string_view text);

// Without the spaces and the quotes around it.
[[nodiscard]] std::string_view bare(std::string_view field) noexcept;

[[nodiscard]] std::optional<double> to_number(std::string_view field) noexcept;

// What programs write where there is no value: nothing, NA, N/A, null, none, - or ?.
[[nodiscard]] bool is_nothing(std::string_view field);

// Of a whole line, bare.
[[nodiscard]] std::vector<std::string_view> fields_of(std::string_view line);

// As `bare`, in lower case, and without brackets around it.
[[nodiscard]] std::string word_of(std::string_view field);

// Whether a heading calls its column a time: time_s, "Elapsed time", Timestamp, t (s), seconds.
[[nodiscard]] bool is_time_name(std::string_view field);

}  // namespace perimap
