// The dictionaries of ArUco and AprilTag markers, by their names.
#pragma once

#include <span>
#include <string>

#include "core/error/expected.hpp"

namespace perimap {

struct MarkerDictionary {
  const char* name;
  int id;  // OpenCV's number of it
};

// All that there are.
[[nodiscard]] std::span<const MarkerDictionary> marker_dictionaries() noexcept;

// "4X4_250"; "?" for a number that is none of OpenCV's.
[[nodiscard]] const char* dictionary_name(int id);

// OpenCV's number of it; an error names those that there are.
[[nodiscard]] Expected<int> dictionary_named(const std::string& name);

}  // namespace perimap
