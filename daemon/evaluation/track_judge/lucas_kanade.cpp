#include "daemon/evaluation/track_judge/lucas_kanade.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include "daemon/evaluation/track_judge/lucas_kanade_module.hpp"

namespace perimap {
namespace {

// As the module for videos is: found by the programs' run path, and never unloaded.
Expected<const LucasKanadeModule*> load() {
  const auto failed = [] {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): each thread has its own in glibc
    return fail(fmt::format("Lucas-Kanade can not be held against: {}", dlerror()));
  };
  void* const library = dlopen(kLucasKanadeModule, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return failed();
  const auto entry = reinterpret_cast<decltype(&perimap_lucas_kanade_module)>(dlsym(library, kLucasKanadeModuleEntry));
  if (entry == nullptr) return failed();
  return entry();
}

}  // namespace

Expected<std::unique_ptr<LucasKanade>> LucasKanade::create() {
  static const Expected<const LucasKanadeModule*> loaded = load();
  return loaded.and_then([](const LucasKanadeModule* module) { return module->create(); });
}

}  // namespace perimap
