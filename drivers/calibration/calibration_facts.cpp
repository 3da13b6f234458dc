#include "drivers/calibration/calibration_facts.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <cstddef>
#include <ctime>
#include <exception>

#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 20;

}  // namespace

std::optional<std::string> calibration_fact(const std::filesystem::path& file, const std::string& key) {
  const auto text = read_text_file(file, kLargestFile, "calibration file");
  if (!text || text->size() > kLargestFile) return std::nullopt;
  // yaml-cpp reports what it cannot read by exceptions.
  try {
    const YAML::Node root = YAML::Load(*text);
    if (!root.IsMap()) return std::nullopt;
    const YAML::Node value = root[key];
    if (!value.IsDefined() || !value.IsScalar()) return std::nullopt;
    return value.Scalar();
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

std::optional<CalibrationDate> calibration_date_of(const std::string& text) {
  constexpr std::array<const char*, 4> kFormats{"%Y-%m-%d", "%a %b %d %H:%M:%S %Y", "%a %d %b %Y", "%d %b %Y"};
  for (const char* format : kFormats) {
    std::tm read{};
    if (::strptime(text.c_str(), format, &read) == nullptr) continue;
    const std::chrono::year_month_day day{std::chrono::year(read.tm_year + 1900),
                                          std::chrono::month(static_cast<unsigned>(read.tm_mon + 1)),
                                          std::chrono::day(static_cast<unsigned>(read.tm_mday))};
    if (day.ok()) return CalibrationDate(day);
  }
  return std::nullopt;
}

std::optional<CalibrationDate> camera_calibration_date(const std::filesystem::path& file) {
  if (const auto time = calibration_fact(file, "calibration_time")) {
    if (const auto date = calibration_date_of(*time)) return date;
  }
  struct stat written {};
  if (::stat(file.c_str(), &written) != 0) return std::nullopt;
  return std::chrono::floor<std::chrono::days>(std::chrono::system_clock::from_time_t(written.st_mtime));
}

std::string date_text(CalibrationDate date) {
  const std::chrono::year_month_day day(date);
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(day.year()), static_cast<unsigned>(day.month()),
                     static_cast<unsigned>(day.day()));
}

}  // namespace perimap
