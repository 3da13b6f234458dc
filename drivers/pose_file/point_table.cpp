#include "drivers/pose_file/point_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include "core/error/one_line.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 20;
constexpr double kFarthest_mm = 5e4;

std::string_view trimmed(std::string_view field) noexcept {
  constexpr std::string_view kSpace = " \t\r\"";
  field.remove_prefix(std::min(field.find_first_not_of(kSpace), field.size()));
  return field.substr(0, field.find_last_not_of(kSpace) + 1);
}

std::optional<double> number_of(std::string_view field) noexcept {
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

Expected<std::vector<NamedPoint>> parse_point_table(std::string_view text, std::string_view name, LengthUnit unit) {
  if (text.size() > kLargestFile) return fail(on_one_line(fmt::format("{}: is too large for a table of points", name)));
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const double mm = unit == LengthUnit::kMetre ? 1000.0 : 1.0;
  std::vector<NamedPoint> points;
  std::size_t line_number = 0;
  bool first = true;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = trimmed(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    ++line_number;
    if (line.empty() || line.front() == '#') continue;
    std::array<std::string_view, 4> fields;
    std::size_t count = 0;
    for (bool more = true; more; ++count) {
      const std::size_t comma = line.find_first_of(",;\t");
      if (count < fields.size()) fields[count] = trimmed(line.substr(0, comma));
      more = comma != std::string_view::npos;
      if (more) line.remove_prefix(comma + 1);
    }
    const auto x = number_of(fields[1]);
    const auto y = number_of(fields[2]);
    const auto z = number_of(fields[3]);
    if (count != 4 || !x || !y || !z) {
      if (std::exchange(first, false) && !x && !y && !z) continue;  // the heading
      return fail(
          on_one_line(fmt::format("{}:{}: expected four fields name,x,y,z with three numbers", name, line_number)));
    }
    first = false;
    const NamedPoint point{std::string(fields[0]), mm * Vector3d(*x, *y, *z)};
    if (point.p.norm() > kFarthest_mm) {
      return fail(
          on_one_line(fmt::format("{}:{}: a point {:.0f} m away{}", name, line_number, 1e-3 * point.p.norm(),
                                  unit == LengthUnit::kMetre ? ": are its lengths in mm? Then say --unit mm" : "")));
    }
    if (std::any_of(points.begin(), points.end(), [&](const NamedPoint& p) { return p.name == point.name; })) {
      return fail(on_one_line(fmt::format("{}:{}: the point '{}' is there twice", name, line_number, point.name)));
    }
    points.push_back(point);
  }
  if (points.empty()) return fail(on_one_line(fmt::format("{}: there are no points in it", name)));
  return points;
}

Expected<std::vector<NamedPoint>> read_point_table(const std::filesystem::path& file, LengthUnit unit) {
  const auto text = read_text_file(file, kLargestFile, "table of points");
  if (!text) return tl::unexpected(text.error());
  return parse_point_table(*text, file.string(), unit);
}

}  // namespace perimap
