// Certificates: whom they are of, and until when.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "daemon/keys/openssl_handle.hpp"
#include "daemon/keys/role.hpp"
#include "daemon/keys/security_documents.hpp"

namespace perimap {

struct CertificateFacts {
  std::string name;     // CN
  std::string role;     // OU; "authority" of the authority's own
  std::string subject;  // RFC 2253
  std::string serial;   // hexadecimal
  Validity validity;
};

// Of PEM text. `told_as`: how an error names it.
[[nodiscard]] Expected<openssl::Certificate> parse_certificate(std::string_view pem, const std::string& told_as);
[[nodiscard]] Expected<openssl::Key> parse_key(std::string_view pem, const std::string& told_as);
[[nodiscard]] Expected<openssl::RevocationList> parse_revocations(std::string_view pem, const std::string& told_as);

[[nodiscard]] CertificateFacts facts_of(const X509& certificate);

[[nodiscard]] Expected<std::string> to_pem(const X509& certificate);
[[nodiscard]] Expected<std::string> to_pem(const EVP_PKEY& key);  // not encrypted
[[nodiscard]] Expected<std::string> to_pem(const X509_CRL& revocations);

}  // namespace perimap
