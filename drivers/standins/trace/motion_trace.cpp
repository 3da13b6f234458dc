#include "drivers/standins/trace/motion_trace.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <optional>

#include "drivers/pose_file/number_table.hpp"
#include "drivers/pose_file/table_times.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargest = 64U << 20U;
constexpr double kUneven = 0.3;  // of the period, by which a sample may be early or late

// "POI_x" of "POI_x", "POI_y", "POI_z" is of POI.
std::string point_name(const NumberTable& table, std::size_t point) {
  if (table.heading.empty()) return std::to_string(point + 1);
  const std::string& x = table.heading[1 + 3 * point];
  return x.size() > 2 && (x[x.size() - 2] == '_' || x[x.size() - 2] == '.') ? x.substr(0, x.size() - 2) : x;
}

// That the first column can be seconds.
Expected<void> check_seconds(const NumberTable& table, std::string_view name) {
  std::vector<double> times;
  for (const std::vector<double>& row : table.rows) times.push_back(row.front());
  return make_seconds(times, std::nullopt, name);
}

template <class Parse>
auto read(const std::filesystem::path& file, std::string_view what, Parse&& parse) {
  return read_text_file(file, kLargest, what).and_then([&](const std::string& text) {
    return parse(text, file.string());
  });
}

}  // namespace

Expected<MotionTrace> parse_motion_trace(std::string_view text, std::string_view name) {
  if (text.size() > kLargest) return fail(fmt::format("{}: more than {} MB", name, kLargest >> 20U));
  const auto table = parse_number_table(text, name);
  if (!table) return tl::unexpected(table.error());
  const auto& rows = table->rows;
  if (rows.size() < 2) return fail(fmt::format("{}: expected samples, one a line", name));
  const std::size_t columns = rows.front().size();
  if (columns < 4 || columns % 3 != 1) {
    return fail(fmt::format("{}: expected a time and x, y, z of each point, got {} columns", name, columns));
  }
  if (const auto seconds = check_seconds(*table, name); !seconds) return tl::unexpected(seconds.error());
  MotionTrace trace;
  trace.first_s = rows.front().front();
  trace.period_s = (rows.back().front() - trace.first_s) / static_cast<double>(rows.size() - 1);
  trace.positions.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns - 1));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < columns; ++k) {
      if (!std::isfinite(rows[i][k])) {
        return fail(fmt::format("{}:{}: column {} is no number", name, table->lines[i], k + 1));
      }
      if (k > 0) trace.positions(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k - 1)) = rows[i][k];
    }
    const double expected_s = trace.first_s + static_cast<double>(i) * trace.period_s;
    if (!(std::abs(rows[i].front() - expected_s) < kUneven * trace.period_s)) {
      return fail(
          fmt::format("{}:{}: the time is {:g} s where even samples have {:g}: samples are missing, or times do "
                      "not grow",
                      name, table->lines[i], rows[i].front(), expected_s));
    }
  }
  for (std::size_t p = 0; p < (columns - 1) / 3; ++p) trace.points.push_back(point_name(*table, p));
  return trace;
}

Expected<MotionTrace> read_motion_trace(const std::filesystem::path& file) {
  return read(file, "motion trace (CSV)", parse_motion_trace);
}

Expected<std::vector<double>> parse_r_peaks(std::string_view text, std::string_view name) {
  const auto table = parse_number_table(text, name);
  if (!table) return tl::unexpected(table.error());
  if (const auto seconds = check_seconds(*table, name); !seconds) return tl::unexpected(seconds.error());
  std::vector<double> peaks_s;
  for (std::size_t i = 0; i < table->rows.size(); ++i) {
    const double t = table->rows[i].front();
    if (table->rows[i].size() != 1 || !std::isfinite(t) || (!peaks_s.empty() && t <= peaks_s.back())) {
      return fail(fmt::format("{}:{}: expected one time in seconds, later than the one before", name, table->lines[i]));
    }
    peaks_s.push_back(t);
  }
  return peaks_s;
}

Expected<std::vector<double>> read_r_peaks(const std::filesystem::path& file) {
  return read(file, "list of R peaks", parse_r_peaks);
}

}  // namespace perimap
