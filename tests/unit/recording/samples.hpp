// One sample of every recorded type with every member set to a value of its own, and any sample as JSON.
#pragma once

#include <nlohmann/json.hpp>

#include "drivers/recording/cdr.hpp"

namespace perimap::test {

// `seed` makes samples differ from each other.
template <class T>
[[nodiscard]] Sample<T> make_sample(unsigned seed);

// Every member by its IDL name. 64-bit integers are decimal strings, because JSON readers may round them.
template <class T>
[[nodiscard]] nlohmann::json to_json(const T& sample);

}  // namespace perimap::test
