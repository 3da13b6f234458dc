// The module's part of lucas_kanade.hpp.
#pragma once

#include <memory>

#include "core/error/expected.hpp"
#include "drivers/video/lucas_kanade.hpp"

namespace perimap {

[[nodiscard]] Expected<std::unique_ptr<LucasKanade>> make_lucas_kanade();

}  // namespace perimap
