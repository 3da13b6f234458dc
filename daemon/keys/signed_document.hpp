// Documents that an authority has signed, as S/MIME (RFC 8551): what DDS Security reads governance and permissions
// from.
#pragma once

#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "daemon/keys/openssl_handle.hpp"

namespace perimap {

// The document in clear with a detached signature by `signer`.
[[nodiscard]] Expected<std::string> sign_document(std::string_view document, X509& signer, EVP_PKEY& key);

// The document, when `authority` has signed it. `told_as`: how an error names it.
[[nodiscard]] Expected<std::string> verified_document(std::string_view message, X509& authority,
                                                      const std::string& told_as);

}  // namespace perimap
