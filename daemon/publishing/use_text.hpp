// What a surface may be used for, as it was published, in words and as JSON.
#pragma once

#include <perimap.h>

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace perimap {

// Of one use.
struct ToldUse {
  perimap_SurfaceState state = perimap_SURFACE_INVALID;
  double within_mm = 0.0;      // 95 % of errors are to be within
  std::uint32_t features = 0;  // converged, of which that is so
};
// To show it, to measure in it, to act in contact with it.
using ToldUses = std::array<ToldUse, 3>;

// None of a perimapd that is older than this.
[[nodiscard]] std::optional<ToldUses> uses_of(const perimap_Surface& surface);
// "show good (31 within 5 mm), measure good (30 within 3 mm), contact degraded (4 within 2 mm)"
[[nodiscard]] std::string uses_words(const ToldUses& uses);
// By the names of the uses, display, measure and contact.
[[nodiscard]] nlohmann::ordered_json uses_json(const ToldUses& uses);

}  // namespace perimap
