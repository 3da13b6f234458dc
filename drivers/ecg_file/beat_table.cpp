#include "drivers/ecg_file/beat_table.hpp"

#include <cmath>

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

}  // namespace

Expected<std::vector<ReferenceBeat>> parse_beat_table(std::string_view text, const std::string& name) {
  std::vector<ReferenceBeat> beats;
  CsvCursor rows(name, text);
  bool first = true;
  bool has_kind = false;
  while (rows.next_line()) {
    std::string_view line = rows.rest_of_line();
    if (line.front() == '#') continue;
    if (first) {
      first = false;
      if (line.substr(0, 4) == "time") {
        const std::size_t comma = line.find(',');
        line = comma == std::string_view::npos ? std::string_view{} : line.substr(comma + 1);
        line = line.substr(0, line.find(','));
        has_kind = line == "symbol" || line == "class";
        continue;
      }
    }
    ReferenceBeat beat;
    const auto time = rows.number<double>();
    if (!time) return tl::unexpected(time.error());
    beat.time_s = *time;
    if (!(std::abs(beat.time_s) < 1e8)) return rows.wrong("the time is out of bounds");
    if (!beats.empty() && beat.time_s <= beats.back().time_s) return rows.wrong("the beats do not ascend");
    if (has_kind) beat.symbol = std::string(rows.field().substr(0, 16));
    beat.kind = kind_of(beat.symbol);
    beats.push_back(std::move(beat));
  }
  if (beats.empty()) return fail(name + ": there are no beats in it");
  return beats;
}

}  // namespace perimap
