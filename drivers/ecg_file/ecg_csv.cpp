#include "drivers/ecg_file/ecg_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "drivers/text_file/csv.hpp"

namespace perimap {
namespace {

constexpr double kLatest_s = 1e8;  // three years; keeps instants within what nanoseconds can count
constexpr double kLargest_mV = 1e6;

std::optional<double> to_number(std::string_view field) {
  while (!field.empty() && field.front() == ' ') field.remove_prefix(1);
  while (!field.empty() && field.back() == ' ') field.remove_suffix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size()) return std::nullopt;
  return value;
}

bool is_blank(std::string_view field) { return field.find_first_not_of(' ') == std::string_view::npos; }

}  // namespace

Expected<EcgTrace> parse_ecg_csv(std::string_view text, const std::string& name, const EcgCsvOptions& options) {
  if (options.rate_hz && !(*options.rate_hz > 0.0)) return fail(name + ": the sample rate must be above 0");
  if (options.column && *options.column < 1) return fail(name + ": columns are counted from 1");
  EcgTrace trace;
  CsvCursor rows(name, text);
  int column = 0;  // from 1; known from the first line on
  bool first = true;
  bool timed = false;
  while (rows.next_line()) {
    const std::string_view line = rows.rest_of_line();
    if (line.front() == '#') continue;
    if (first) {
      const auto fields = 1 + static_cast<int>(std::count(line.begin(), line.end(), ','));
      const bool first_is_time = fields > 1 && (!options.rate_hz || line.substr(0, 4) == "time");
      timed = !options.rate_hz;
      column = options.column.value_or(first_is_time ? 2 : 1);
      if (timed && fields < 2) {
        return rows.wrong("expected time_s,mV in a line; say --rate when there are values alone", line);
      }
      if (column > fields) return rows.wrong(fmt::format("there is no column {}", column));
      if (timed && column == 1) return rows.wrong("column 1 holds the time; choose another, or give --rate");
      first = false;
      const std::string_view field = line.substr(0, line.find(','));
      if (!to_number(field) && !is_blank(field)) continue;  // a heading
    }
    double time_s = 0.0;
    if (timed) {
      const auto value = rows.number<double>();
      if (!value) return tl::unexpected(value.error());
      time_s = *value;
      if (!(std::abs(time_s) < kLatest_s)) return rows.wrong("the time is out of bounds");
      if (!trace.time_s.empty() && time_s <= trace.time_s.back()) return rows.wrong("the times do not ascend");
    } else {
      time_s = static_cast<double>(trace.time_s.size()) / *options.rate_hz;
    }
    for (int skipped = timed ? 2 : 1; skipped < column; ++skipped) static_cast<void>(rows.field());
    if (column > 1 && rows.rest_of_line().data() == nullptr) {
      return rows.wrong(fmt::format("the line has no column {}", column));
    }
    const std::string_view field = rows.field();
    double mV = std::numeric_limits<double>::quiet_NaN();
    if (!is_blank(field)) {
      const auto value = to_number(field);
      if (!value) return rows.wrong("expected a number", field);
      mV = *value * options.gain;
      if (std::abs(mV) > kLargest_mV) return rows.wrong("the value is out of bounds; is --gain right?", field);
    }
    trace.time_s.push_back(time_s);
    trace.mV.push_back(static_cast<float>(mV));
  }
  if (trace.mV.empty()) return fail(name + ": there are no samples in it");
  return trace;
}

}  // namespace perimap
