// A program's keys: whether they are in order, and for how long.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/keys/certificate.hpp"

namespace perimap {

// So long before the end it is told of.
inline constexpr std::chrono::days kKeysToldBefore{28};

struct KeyFacts {
  CertificateFacts certificate;   // of the program
  std::chrono::sys_seconds ends;  // the first of what it rests on to end
  [[nodiscard]] bool ends_soon(std::chrono::sys_seconds now) const { return ends - now < kKeysToldBefore; }
};

// What DDS Security would look at, before it does, and with words: every file is there and can be read, the certificate
// is of the authority, holds now and is not revoked, the key is its key and nobody's but the owner's and the group's,
// governance and permissions are signed by the authority and are this certificate's, and all are byte by byte as they
// were issued. An error names the first thing that is wrong.
[[nodiscard]] Expected<KeyFacts> check_keys(const std::filesystem::path& folder, std::chrono::sys_seconds now);

// "keys of 'theatre-2' (publisher) end 2026-12-24T18:00:00Z, in 12 days: issue new ones in time"; none while that is
// far off.
[[nodiscard]] std::optional<std::string> expiry_warning(const KeyFacts& keys, std::chrono::sys_seconds now);

[[nodiscard]] inline std::chrono::sys_seconds seconds_now() {
  return std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
}

}  // namespace perimap
