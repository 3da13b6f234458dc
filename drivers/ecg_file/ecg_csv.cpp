#include "drivers/ecg_file/ecg_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/ecg_file/table_field.hpp"
#include "drivers/text_file/csv.hpp"

namespace perimap {
namespace {

constexpr double kLatest_s = 4e9;  // the year 2096 in Unix time; keeps instants within what nanoseconds can count
constexpr double kLargest_mV = 1e6;

bool is_seconds(std::string_view unit) {
  const std::string word = word_of(unit);
  return word == "s" || word == "sec" || word == "secs" || word == "second" || word == "seconds";
}

// Of an ECG, in a line below the heading.
bool is_unit(std::string_view field) {
  constexpr std::array<std::string_view, 7> kUnits{"v", "mv", "uv", "\u00B5v", "\u03BCv", "nv", "adu"};
  return std::find(kUnits.begin(), kUnits.end(), word_of(field)) != kUnits.end();
}

// What the first line tells of all.
struct Layout {
  std::size_t columns = 0;
  std::size_t ecg = 1;  // its column, from 1
  bool timed = false;   // by the first column
  bool heading = false;
};

Expected<Layout> layout_of(const CsvCursor& rows, const EcgCsvOptions& options) {
  const std::string_view line = rows.rest_of_line();
  const auto fields = fields_of(line);
  const bool names_time = is_time_name(fields[0]);
  const bool has_number = std::any_of(fields.begin(), fields.end(), [](auto field) { return to_number(field); });
  const bool has_text = std::any_of(fields.begin(), fields.end(), [](auto field) { return !field.empty(); });
  Layout layout;
  layout.columns = fields.size();
  layout.heading = names_time || (has_text && !has_number);
  layout.timed = !options.rate_hz;
  if (layout.timed && layout.columns < 2) {
    return rows.wrong("expected time_s,mV in a line; say --rate when there are values alone", line);
  }
  if (!layout.timed && !options.column && layout.columns > 1 && !names_time) {
    return rows.wrong(
        fmt::format("{} columns, and no heading that begins with a time: say by --column which is the ECG",
                    layout.columns),
        line);
  }
  layout.ecg = static_cast<std::size_t>(options.column.value_or(layout.columns > 1 ? 2 : 1));
  if (layout.ecg > layout.columns) return rows.wrong(fmt::format("there is no column {}", layout.ecg));
  if (layout.ecg == 1 && layout.timed) return rows.wrong("column 1 holds the time; choose another, or give --rate");
  if (layout.ecg == 1 && names_time) return rows.wrong("column 1 holds the time; choose another");
  return layout;
}

// Whether the line below the heading gives units, as PhysioNet's rdsamp writes them.
Expected<bool> has_units(const CsvCursor& rows, const Layout& layout) {
  const auto fields = fields_of(rows.rest_of_line());
  if (fields.size() < layout.ecg || !is_unit(fields[layout.ecg - 1])) return false;
  if (layout.timed && !is_seconds(fields[0])) return rows.wrong("expected times in seconds", fields[0]);
  return true;
}

}  // namespace

Expected<EcgTrace> parse_ecg_csv(std::string_view written, const std::string& name, const EcgCsvOptions& options) {
  if (options.rate_hz && !(*options.rate_hz > 0.0)) return fail(name + ": the sample rate must be above 0");
  if (options.column && *options.column < 1) return fail(name + ": columns are counted from 1");
  if (written.starts_with("\xFF\xFE") || written.starts_with("\xFE\xFF")) {
    return fail(name + ": is written in UTF-16; save it as UTF-8");
  }
  const std::string text = with_commas(written);
  EcgTrace trace;
  CsvCursor rows(name, text);
  std::optional<Layout> layout;
  bool after_heading = false;
  bool first_row = true;
  while (rows.next_line()) {
    if (rows.rest_of_line().front() == '#') continue;
    if (!layout) {
      auto first = layout_of(rows, options);
      if (!first) return tl::unexpected(first.error());
      layout = *first;
      after_heading = layout->heading;
      if (layout->heading) continue;
    }
    if (std::exchange(after_heading, false)) {
      const auto units = has_units(rows, *layout);
      if (!units) return tl::unexpected(units.error());
      if (*units) continue;
    }
    if (std::exchange(first_row, false) && layout->heading &&
        fields_of(rows.rest_of_line()).size() == 2 * layout->columns && layout->columns > 1) {
      return rows.wrong(
          "twice as many fields as the heading has: are commas the decimal signs as well? Separate the fields by "
          "semicolons or tabs",
          rows.rest_of_line());
    }
    double time_s = 0.0;
    if (layout->timed) {
      const std::string_view field = rows.field();
      const auto value = to_number(field);
      if (!value) return rows.wrong("expected a number", field);
      time_s = *value;
      if (!(std::abs(time_s) < kLatest_s)) {
        return rows.wrong("the time is out of bounds: seconds are expected, as Unix times too; is it in milliseconds?",
                          field);
      }
      if (!trace.time_s.empty() && time_s <= trace.time_s.back()) return rows.wrong("the times do not ascend");
    } else {
      time_s = static_cast<double>(trace.time_s.size()) / *options.rate_hz;
    }
    for (std::size_t skipped = layout->timed ? 2 : 1; skipped < layout->ecg; ++skipped) {
      static_cast<void>(rows.field());
    }
    if (layout->ecg > 1 && rows.rest_of_line().data() == nullptr) {
      return rows.wrong(fmt::format("the line has no column {}", layout->ecg));
    }
    const std::string_view field = rows.field();
    double mV = std::numeric_limits<double>::quiet_NaN();
    if (!is_nothing(field)) {
      const auto value = to_number(field);
      if (!value) return rows.wrong("expected a number", field);
      mV = *value * options.gain;
      if (std::abs(mV) > kLargest_mV) return rows.wrong("the value is out of bounds; is --gain right?", field);
    }
    // A decimal comma would else take off what follows it.
    if (layout->columns == 1 && rows.rest_of_line().data() != nullptr) {
      return rows.wrong("expected one value in a line, as in the first");
    }
    trace.time_s.push_back(time_s);
    trace.mV.push_back(static_cast<float>(mV));
  }
  if (trace.mV.empty()) return fail(name + ": there are no samples in it");
  return trace;
}

}  // namespace perimap
