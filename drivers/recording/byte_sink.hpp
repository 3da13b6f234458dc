// Where a writer's bytes go.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "core/error/expected.hpp"

namespace perimap {

class ByteSink {
 public:
  virtual ~ByteSink() = default;
  // All of the bytes, or an error.
  [[nodiscard]] virtual Expected<void> write(std::span<const std::byte> bytes) = 0;
  // Reports what only the end can tell (a full network disk). Nothing may be written after it.
  [[nodiscard]] virtual Expected<void> close() = 0;
};

// Creates the file, or empties it; a new one is for its owner alone, since what is recorded is a patient's. Errors call
// it `told_as`, or else by its path.
[[nodiscard]] Expected<std::unique_ptr<ByteSink>> create_file(const std::string& path, const std::string& told_as = "");

}  // namespace perimap
