// What a person who looks at the page is told about a state: what may be trusted, why not, what to do.
#pragma once

#include <perimap.h>

#include <string_view>

namespace perimap {

// What may be done with positions of a surface in this state. A state that is not known may do nothing.
[[nodiscard]] std::string_view permission_of(perimap_SurfaceState state) noexcept;

// What to do about a reason; empty where nothing is to be done. A reason that is not known has a sentence, too.
[[nodiscard]] std::string_view remedy_of(perimap_SurfaceReason reason) noexcept;

}  // namespace perimap
