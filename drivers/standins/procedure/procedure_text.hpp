// Procedures as TOML, read and written.
//
//   version = 1
//   [[event]]
//   kind = "retraction"
//   at_s = 40.0
//   for_s = 2.0
//   shift_mm = [6.0, 0.0, 0.0]
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "drivers/standins/procedure/procedure.hpp"

namespace perimap {

// Errors are all that is wrong, in the order of the file, a line each: `FILE:LINE:COL: key 'event[2].at_s': expected
// ..., got ...`, and of an unknown key or kind which one may have been meant. What stands in the file need not be in
// order of time; the procedure is. A value that is not said is that of procedure.hpp. Every number is finite and within
// its limits; what moves one and the same thing (the organ by one kind of event, the scope, a delay) does not overlap.
[[nodiscard]] Expected<Procedure> parse_procedure(std::string_view text, const std::string& file);
[[nodiscard]] Expected<Procedure> load_procedure(const std::filesystem::path& file);

// What parse_procedure() reads back as the same.
[[nodiscard]] std::string to_toml(const Procedure& procedure);

// As TOML has it: 3.0, [1.0, 2.0].
[[nodiscard]] std::string value_text(double value);
[[nodiscard]] std::string value_text(const Vector2d& value);
[[nodiscard]] std::string value_text(const Vector3d& value);

}  // namespace perimap
