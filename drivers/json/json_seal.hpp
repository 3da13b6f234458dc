// A key by which a JSON object that a program has written tells whether it still says what it said.
#pragma once

#include <nlohmann/json.hpp>

#include "core/error/expected.hpp"

namespace perimap {

// The same with the key "perimap_crc32": eight hexadecimal digits, the CRC-32 of all other keys and values, as one
// line of UTF-8 without spaces, keys in order. Without it such an object reads as well when a digit of it is another.
[[nodiscard]] nlohmann::json sealed_json(nlohmann::json object);

// Of an object with that key: it says what it said when it was written. An object without it is anybody's, and right.
// The error says what to do, and is for a message that names the file.
[[nodiscard]] Expected<void> check_json_seal(const nlohmann::json& object);

}  // namespace perimap
