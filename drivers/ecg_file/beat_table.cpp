#include "drivers/ecg_file/beat_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "drivers/ecg_file/table_field.hpp"
#include "drivers/text_file/csv.hpp"

namespace perimap {
namespace {

ReferenceBeat::Kind kind_of(std::string_view symbol) {
  if (symbol == "normal") return ReferenceBeat::Kind::kNormal;
  if (symbol == "premature") return ReferenceBeat::Kind::kPremature;
  if (symbol.size() != 1) return ReferenceBeat::Kind::kUnknown;
  if (std::string_view("AaJSV").find(symbol) != std::string_view::npos) return ReferenceBeat::Kind::kPremature;
  if (std::string_view("NLRBejn/f*").find(symbol) != std::string_view::npos) return ReferenceBeat::Kind::kNormal;
  return ReferenceBeat::Kind::kUnknown;
}

// What PhysioNet lists as annotations that are no beats, but for `*`.
bool is_beat(std::string_view symbol) {
  return symbol.size() != 1 || std::string_view("[!]x()ptu`'^|~+sTD=\"@").find(symbol) == std::string_view::npos;
}

// The column that a heading names as that of the symbols.
std::optional<std::size_t> symbol_column(const std::vector<std::string_view>& heading) {
  const auto named = std::find_if(heading.begin() + 1, heading.end(), [](std::string_view field) {
    const std::string name = word_of(field);
    return name == "symbol" || name == "class";
  });
  if (named == heading.end()) return std::nullopt;
  return static_cast<std::size_t>(named - heading.begin());
}

// Cut to what can be shown.
std::string symbol_of(std::string_view field) {
  constexpr std::size_t kLongest = 16;
  if (field == "\"\"") return "\"";  // as a quoted field has it
  return std::string(field.substr(0, kLongest));
}

}  // namespace

Expected<BeatTable> parse_beat_table(std::string_view written, const std::string& name) {
  const std::string text = with_commas(written);
  BeatTable table;
  CsvCursor rows(name, text);
  bool first = true;
  bool has_heading = false;
  std::optional<std::size_t> symbols;
  double last_s = -std::numeric_limits<double>::infinity();  // of any annotation
  while (rows.next_line()) {
    if (rows.rest_of_line().front() == '#') continue;
    const auto fields = fields_of(rows.rest_of_line());
    if (std::exchange(first, false) && is_time_name(fields[0])) {
      has_heading = true;
      symbols = symbol_column(fields);
      continue;
    }
    ReferenceBeat beat;
    const auto time = to_number(fields[0]);
    if (!time) return rows.wrong("expected a number", fields[0]);
    beat.time_s = *time;
    if (!(std::abs(beat.time_s) < 4e9)) return rows.wrong("the time is out of bounds");
    if (has_heading) {
      if (symbols && *symbols < fields.size()) beat.symbol = symbol_of(fields[*symbols]);
    } else if (fields.size() > 1 && !to_number(fields[1])) {
      beat.symbol = symbol_of(fields[1]);
    }
    // What is no beat may stand beside one.
    const bool counts = is_beat(beat.symbol);
    const bool repeats = counts && !table.beats.empty() && beat.time_s <= table.beats.back().time_s;
    if (beat.time_s < last_s || repeats) return rows.wrong("the beats do not ascend");
    last_s = beat.time_s;
    if (!counts) {
      ++table.left_out;
      continue;
    }
    beat.kind = kind_of(beat.symbol);
    table.beats.push_back(std::move(beat));
  }
  if (table.beats.empty()) return fail(name + ": there are no beats in it");
  return table;
}

}  // namespace perimap
