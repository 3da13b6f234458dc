// Governance and permissions of a secured domain, as OMG DDS Security 1.1 (formal/18-04-01), 9.4.1, has them.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "daemon/keys/role.hpp"

namespace perimap {

struct Validity {
  std::chrono::sys_seconds from;
  std::chrono::sys_seconds until;
};

// Of every domain: nobody joins without a certificate, discovery is encrypted, and so is all that is sent.
[[nodiscard]] std::string governance_xml();

// What the owner of the certificate with this subject (RFC 2253) may do, and for how long; all else is denied.
[[nodiscard]] std::string permissions_xml(std::string_view name, std::string_view subject, const RoleRights& rights,
                                          const Validity& validity);

// "2026-11-26T18:00:00Z"
[[nodiscard]] std::string utc_text(std::chrono::sys_seconds t);

}  // namespace perimap
