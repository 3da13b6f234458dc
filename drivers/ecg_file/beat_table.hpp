// Reference beats as a table: `time_s`, and what kind of beat each is where that is known.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct ReferenceBeat {
  enum class Kind : std::uint8_t { kUnknown, kNormal, kPremature };

  double time_s = 0.0;
  std::string symbol;  // as in the table; empty when there is none
  Kind kind = Kind::kUnknown;
};

struct BeatTable {
  std::vector<ReferenceBeat> beats;  // in order of time
  std::size_t left_out = 0;          // annotations that are no beats
};

// The first column is the time in seconds, ascending. A heading begins with a name of a time (`is_time_name`); its
// column named `symbol` or `class` tells the kinds. Without a heading the second column does, where it is no number.
// Kinds are the words normal and premature, or the symbols of the MIT-BIH databases: A a J S V are premature, N L R B e
// j n / f are normal to the rhythm, others unknown. `*` is any other beat, as in tables that tell ventricular beats
// alone, and normal; the annotations that PhysioNet lists as no beats, [ ! ] x ( ) p t u ` ' ^ | ~ + s T D = " @, are
// left out. (It lists `*` too, the systole of a pressure, which an ECG has none of.) Further columns are passed over.
// Errors: "NAME:LINE:COLUMN: what is wrong".
[[nodiscard]] Expected<BeatTable> parse_beat_table(std::string_view written, const std::string& name);

}  // namespace perimap
