// What libperimap_lucas_kanade.so, the module with OpenCV's tracker, gives the program that loads it. Both are of one
// build.
#pragma once

#include <memory>

#include "core/error/expected.hpp"
#include "daemon/evaluation/track_judge/lucas_kanade.hpp"

namespace perimap {

struct LucasKanadeModule {
  // As LucasKanade::create().
  Expected<std::unique_ptr<LucasKanade>> (*create)();
};

inline constexpr const char* kLucasKanadeModule = "libperimap_lucas_kanade.so";
inline constexpr const char* kLucasKanadeModuleEntry = "perimap_lucas_kanade_module";

}  // namespace perimap

// Never null. By the name above.
extern "C" [[gnu::visibility("default")]] const perimap::LucasKanadeModule* perimap_lucas_kanade_module();
