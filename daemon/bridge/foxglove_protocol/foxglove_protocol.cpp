#include "daemon/bridge/foxglove_protocol/foxglove_protocol.hpp"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint8_t kMessageData = 1;

std::optional<std::uint32_t> id_of(const Json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto number = value.get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

std::optional<std::uint32_t> id_of(const Json& object, const char* member) {
  if (!object.is_object()) return std::nullopt;
  const auto found = object.find(member);
  return found == object.end() ? std::nullopt : id_of(*found);
}

Expected<Json> list_of(const Json& json, const char* member) {
  const auto found = json.find(member);
  if (found == json.end() || !found->is_array()) return fail(fmt::format("'{}' is a list", member));
  return *found;
}

// Little-endian, as the protocol is.
template <class Number>
void append(std::string& bytes, Number number) {
  for (std::size_t i = 0; i < sizeof number; ++i) bytes.push_back(static_cast<char>(number >> (8 * i) & 0xFF));
}

}  // namespace

Expected<FoxgloveRequest> parse_foxglove_request(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return fail("expected a JSON object");
  const auto op = json.find("op");
  if (op == json.end() || !op->is_string()) return fail("expected a member 'op', a text");
  FoxgloveRequest request;
  if (*op == "subscribe") {
    const auto list = list_of(json, "subscriptions");
    if (!list) return tl::unexpected(list.error());
    for (const Json& entry : *list) {
      const auto id = id_of(entry, "id");
      const auto channel = id_of(entry, "channelId");
      if (!id || !channel) return fail("a subscription has 'id' and 'channelId', numbers below 2^32");
      request.subscribe.push_back({*id, *channel});
    }
  } else if (*op == "unsubscribe") {
    const auto list = list_of(json, "subscriptionIds");
    if (!list) return tl::unexpected(list.error());
    for (const Json& entry : *list) {
      const auto id = id_of(entry);
      if (!id) return fail("the id of a subscription is a number below 2^32");
      request.unsubscribe.push_back(*id);
    }
  }
  return request;
}

std::string foxglove_server_info(std::string_view name, std::string_view session) {
  return json_line(
      Json::object({{"op", "serverInfo"}, {"name", name}, {"capabilities", Json::array()}, {"sessionId", session}}));
}

std::string foxglove_advertise(std::span<const FoxgloveChannel> channels) {
  Json list = Json::array();
  for (const FoxgloveChannel& channel : channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", kMessageEncoding},
                    {"schemaName", channel.type.schema_name()},
                    {"schemaEncoding", kSchemaEncoding},
                    {"schema", channel.type.schema_text}});
  }
  return json_line(Json::object({{"op", "advertise"}, {"channels", std::move(list)}}));
}

std::string foxglove_status(FoxgloveLevel level, std::string_view message) {
  return json_line(Json::object({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}}));
}

std::string foxglove_message(std::uint32_t subscription, Instant utc, std::string_view cdr) {
  std::string bytes;
  bytes.reserve(1 + sizeof subscription + sizeof(std::uint64_t) + cdr.size());
  append(bytes, kMessageData);
  append(bytes, subscription);
  append(bytes, static_cast<std::uint64_t>(to_ns(utc)));
  bytes += cdr;
  return bytes;
}

}  // namespace perimap
