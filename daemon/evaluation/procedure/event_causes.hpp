// Which reasons of perimap.idl name the cause of an event of a procedure.
#pragma once

#include <perimap.h>

#include <string_view>
#include <vector>

namespace perimap {

struct EventCauses {
  std::vector<perimap_SurfaceReason> right;  // none: no reason names it
  bool must_be_told = false;                 // otherwise saying nothing is right as well
};

// `hides`: whether the organ can hardly be seen during the event. Of a kind that is not known nothing must be told, and
// no cause is right.
[[nodiscard]] EventCauses causes_of(std::string_view kind, bool hides);

// A beat that comes early is none of the script's: what the heart's own rhythm explains.
[[nodiscard]] bool is_of_rhythm(perimap_SurfaceReason reason) noexcept;

}  // namespace perimap
