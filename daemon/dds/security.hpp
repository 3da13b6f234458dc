// DDS Security of a participant: which files Cyclone DDS takes its keys from.
#pragma once

#include <filesystem>
#include <string>

#include "daemon/dds/topic.hpp"

namespace perimap::dds {

// The names of a key folder's files. `perimap keys issue` writes them; what Cyclone DDS makes of them is its business.
namespace key_files {
inline constexpr const char* kAuthority = "authority.pem";      // its certificate: of identities and of permissions
inline constexpr const char* kCertificate = "certificate.pem";  // this program's
inline constexpr const char* kKey = "key.pem";                  // its private key
inline constexpr const char* kRevoked = "revoked.pem";          // certificates that count no more
inline constexpr const char* kGovernance = "governance.p7s";    // signed by the authority
inline constexpr const char* kPermissions = "permissions.p7s";  // likewise
}  // namespace key_files

// Of one of Cyclone's three plugins ("auth", "ac", "crypto"). Debian has them in a folder beside the library that the
// linker does not look into.
[[nodiscard]] std::string plugin_path(const std::string& plugin);

// The properties by which a participant is secured (DDS Security 1.1, 8.8.2 and 9.3.1, and Cyclone's own for plugins
// and revocation).
[[nodiscard]] Qos secured_qos(const std::filesystem::path& keys);

}  // namespace perimap::dds
