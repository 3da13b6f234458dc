// What the watch over the set-up says, in words and for machines.
#pragma once

#include <perimap.h>

#include <nlohmann/json.hpp>
#include <string>

namespace perimap {

// On one line: which number is off, by how much, and what to do next; or that none is known to be.
[[nodiscard]] std::string setup_words(const perimap_SetupWatch& setup);

// `number` is what is blamed, null where nothing is. Values may come from outside: none is trusted as an index.
[[nodiscard]] nlohmann::ordered_json setup_json(const perimap_SetupWatch& setup);

}  // namespace perimap
