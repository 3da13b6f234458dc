// What a calibration says of itself: when it was made, and of what.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace perimap {

using CalibrationDate = std::chrono::sys_days;

// Of a text that begins with 2026-11-25, as perimap writes it, or is as OpenCV's calibration program writes it
// (strftime's %c: "Wed Nov 25 18:30:00 2026", "Wed 25 Nov 2026 06:30:00 PM UTC"); none: it is neither, or no day.
[[nodiscard]] std::optional<CalibrationDate> calibration_date_of(const std::string& text);

// The text of a key of a calibration as YAML or JSON, of a camera or a tool; none: there is no such key, or no such
// file, and what is wrong with it is said where the calibration itself is read.
[[nodiscard]] std::optional<std::string> calibration_fact(const std::filesystem::path& file, const std::string& key);

// The key calibration_time of a camera's calibration file; where it has none, the day on which the file was written
// last, since when the calibration has not become younger. None: the file cannot be read.
[[nodiscard]] std::optional<CalibrationDate> camera_calibration_date(const std::filesystem::path& file);

// 2026-11-25
[[nodiscard]] std::string date_text(CalibrationDate date);

}  // namespace perimap
