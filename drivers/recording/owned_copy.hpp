// Samples that DDS lends, to keep.
#pragma once

#include <optional>
#include <utility>

#include "drivers/recording/cdr.hpp"

namespace perimap {

// A copy that owns its sequences; none when it is not valid.
template <class T>
[[nodiscard]] std::optional<Sample<T>> owned_copy_of(const T& sample) {
  CdrSerializer serializer;
  const auto bytes = serializer.serialize(sample);
  if (!bytes) return std::nullopt;
  auto copy = deserialize<T>(*bytes);
  if (!copy) return std::nullopt;
  return std::move(*copy);
}

}  // namespace perimap
