// What a server and its clients say to each other on a WebSocket of the viewers Foxglove and Lichtblick:
// https://github.com/foxglove/ws-protocol, which names its subprotocol foxglove.websocket.v1, and
// foxglove.sdk.v1 with the same messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/topic.hpp"

namespace perimap {

inline constexpr const char* kFoxgloveSubprotocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

// What a client asks for.
struct FoxgloveRequest {
  struct Subscription {
    std::uint32_t id = 0;  // of the client's choosing
    std::uint32_t channel = 0;
  };
  std::vector<Subscription> subscribe;
  std::vector<std::uint32_t> unsubscribe;  // by their ids
};

// Any bytes are safe; an error is one printable line. What is asked for that this server does not offer is no error,
// and asks for nothing.
[[nodiscard]] Expected<FoxgloveRequest> parse_foxglove_request(std::string_view text);

struct FoxgloveChannel {
  std::uint32_t id = 0;
  std::string_view topic;
  TopicType type;
};

// Text messages. `session` tells a client that connects anew whether it is the same server still.
[[nodiscard]] std::string foxglove_server_info(std::string_view name, std::string_view session);
[[nodiscard]] std::string foxglove_advertise(std::span<const FoxgloveChannel> channels);
enum class FoxgloveLevel : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };
[[nodiscard]] std::string foxglove_status(FoxgloveLevel level, std::string_view message);

// A binary message: one of a channel, `cdr` as CdrSerializer writes it, for one subscription.
[[nodiscard]] std::string foxglove_message(std::uint32_t subscription, Instant utc, std::string_view cdr);

}  // namespace perimap
