#include "daemon/black_box/json_members.hpp"

namespace perimap::black_box {

std::uint64_t JsonMembers::number(const char* key) {
  const auto* found = member(key);
  if (found == nullptr || !found->is_number_unsigned()) return wrong(key, "a whole number"), 0;
  return found->get<std::uint64_t>();
}

std::int64_t JsonMembers::instant(const char* key) {
  const auto* found = member(key);
  if (found == nullptr || !found->is_number_integer()) return wrong(key, "an instant"), 0;
  return found->get<std::int64_t>();
}

std::string JsonMembers::text(const char* key) {
  const auto* found = member(key);
  if (found == nullptr || !found->is_string()) return wrong(key, "text"), std::string();
  return found->get<std::string>();
}

bool JsonMembers::flag(const char* key) {
  const auto* found = member(key);
  if (found == nullptr || !found->is_boolean()) return wrong(key, "true or false"), false;
  return found->get<bool>();
}

Digest JsonMembers::digest(const char* key) {
  const auto value = digest_of_hex(text(key));
  if (!value) wrong(key, "a digest of 64 hexadecimal digits");
  return value.value_or(Digest{});
}

const nlohmann::ordered_json* JsonMembers::member(const char* key) const {
  const auto found = object_.is_object() ? object_.find(key) : object_.end();
  return found == object_.end() ? nullptr : &*found;
}

void JsonMembers::wrong(const char* key, const char* expected) {
  if (fault_.empty()) fault_ = std::string("expected '") + key + "' in " + where_ + " to be " + expected;
}

}  // namespace perimap::black_box
