// What `perimap verify` said last of a set-up: a file beside the configuration, and an attachment of recordings.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"

namespace perimap {

// What was verified, number by number: another set-up differs in one of them at least.
struct VerifiedSetUp {
  std::array<double, 3> translation_SC_mm{};
  std::array<double, 4> rotation_SC_wxyz{1.0, 0.0, 0.0, 0.0};
  double time_offset_ms = 0.0;
  std::vector<double> lens;  // lens_numbers(); empty: no lens is named
  std::string turned_scope;  // the date of the turned scope's calibration; empty: there is none

  [[nodiscard]] bool operator==(const VerifiedSetUp&) const = default;
};

[[nodiscard]] std::vector<double> lens_numbers(const CameraModel& camera);

struct VerificationRecord {
  // An error in mm or ms with its standard deviation.
  struct Figure {
    double error = 0.0;
    double deviation = 0.0;
  };
  std::string date;  // 2026-11-25 18:30 UTC
  bool passed = false;
  double bound_mm = 0.0;
  Figure board_mm;
  Figure clocks_ms;
  std::optional<Figure> touch_mm;  // none: no point was touched
  VerifiedSetUp set_up;
  bool changed_since = false;  // of an attachment: what was recorded had another set-up

  // Whether there is something to be looked at.
  [[nodiscard]] bool is_doubtful() const { return !passed || changed_since; }
};

// devices.toml: devices.verified.json in the same folder.
[[nodiscard]] std::filesystem::path verification_file_of(const std::filesystem::path& configuration_file);

// The result as verify tells it (JSON), with what it is of.
[[nodiscard]] std::string format_verification(std::string_view result_json, const VerifiedSetUp& set_up);

// The same record, as it is attached where the set-up has been changed since.
[[nodiscard]] std::string as_changed_since(std::string_view record_json);

// `name` stands for the file in errors, which name the key.
[[nodiscard]] Expected<VerificationRecord> parse_verification(std::string_view text, std::string_view name);

// A file's text; nothing where there is none.
[[nodiscard]] Expected<std::optional<std::string>> read_verification(const std::filesystem::path& file);

// One line: when, whether it passed, by how much the set-up was off, and what to do where it is doubtful.
[[nodiscard]] std::string words_of(const VerificationRecord& record);

}  // namespace perimap
