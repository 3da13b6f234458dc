// Members of the JSON objects that a black box holds.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/digest/digest.hpp"

namespace perimap::black_box {

// Reads members of one object, or of what is none and has none; the first that is wrong is remembered. Lives no longer
// than the object.
class JsonMembers {
 public:
  // `where`: what a fault calls the object.
  JsonMembers(const nlohmann::ordered_json& object, const char* where) : object_(object), where_(where) {}

  // What is wrong is 0, empty, or false.
  std::uint64_t number(const char* key);
  std::int64_t instant(const char* key);
  std::string text(const char* key);
  bool flag(const char* key);
  Digest digest(const char* key);

  // Empty while nothing was wrong.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  [[nodiscard]] const nlohmann::ordered_json* member(const char* key) const;
  void wrong(const char* key, const char* expected);

  const nlohmann::ordered_json& object_;
  const char* where_;
  std::string fault_;
};

}  // namespace perimap::black_box
