// What a simulated heart looks like.
#pragma once

#include <cstdint>

namespace perimap {

enum class Look : std::uint8_t {
  kRendered,  // strong texture under a steady light: easier to follow than tissue is
  kTissue     // as footage of tissue is by its statistics (docs/evidence/looks.md)
};

[[nodiscard]] constexpr const char* name_of(Look look) noexcept {
  return look == Look::kTissue ? "tissue" : "rendered";
}

}  // namespace perimap
