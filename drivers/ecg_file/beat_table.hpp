// Reference beats as a table: `time_s`, and what kind of beat each is where that is known.
#pragma once

#include <optional>
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

// The first column is the time in seconds, ascending. A second one named `symbol` or `class` tells the kind: the words
// normal and premature, or a symbol of the MIT-BIH databases: A a J S V are premature, N L R B e j n / f and * (any
// other beat) are normal to the rhythm, others unknown. Further columns are passed over. Errors: "NAME:LINE:COLUMN:
// what is wrong".
[[nodiscard]] Expected<std::vector<ReferenceBeat>> parse_beat_table(std::string_view text, const std::string& name);

}  // namespace perimap
