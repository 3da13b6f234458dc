// Feeds a device's protocol with bytes as they may come: in chunks of any size, at any time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "scripted_link.hpp"

namespace perimap {

// The protocol is open; each chunk comes `apart` after the one before.
inline void feed_in_chunks(DeviceProtocol& protocol, ScriptedLink& link, Instant now, std::span<const std::byte> bytes,
                           std::size_t chunk, Duration apart) {
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    now += apart;
    protocol.on_bytes(link, bytes.subspan(at, std::min(chunk, bytes.size() - at)), now);
    if (now >= protocol.next_time()) protocol.on_time(link, now);
  }
}

}  // namespace perimap
