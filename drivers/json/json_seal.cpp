#include "drivers/json/json_seal.hpp"

#include <fmt/format.h>
#include <libdeflate.h>

#include <string>

#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

constexpr const char* kKey = "perimap_crc32";

std::string seal_of(const nlohmann::json& object) {
  const std::string text = json_line(object);
  return fmt::format("{:08x}", libdeflate_crc32(0, text.data(), text.size()));
}

}  // namespace

nlohmann::json sealed_json(nlohmann::json object) {
  object.erase(kKey);
  object[kKey] = seal_of(object);
  return object;
}

Expected<void> check_json_seal(const nlohmann::json& object) {
  const auto seal = object.find(kKey);
  if (seal == object.end()) return {};
  nlohmann::json rest = object;
  rest.erase(kKey);
  if (*seal == seal_of(rest)) return {};
  return fail(fmt::format(
      "it does not say what it said when it was written. Whoever has changed it on purpose takes the key '{}' away",
      kKey));
}

}  // namespace perimap
