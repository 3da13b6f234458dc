// The authority of a secured domain: who may take part, and as what.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/keys/certificate.hpp"
#include "daemon/keys/role.hpp"
#include "daemon/keys/security_documents.hpp"

namespace perimap {

struct Issued {
  CertificateFacts facts;
  bool revoked = false;
};

// A folder:
//   authority/        its private key, its certificate, the certificates that it has issued: stays where it was made
//   revoked.pem       what counts no more; a copy of it is in each folder below
//   NAME/             for the program NAME, to be carried to its machine: see daemon/dds/security.hpp for its files,
//   and
//                     cyclonedds.xml by which a program that knows nothing of perimap takes them
//
// One key pair signs identities, governance and permissions. Keys are on the curve P-256, signatures ECDSA with
// SHA-256. The private key is not encrypted: who can read the folder can issue. Errors name the file.
class Authority {
 public:
  // In a folder that has none yet.
  [[nodiscard]] static Expected<Authority> create(const std::filesystem::path& folder, const std::string& name,
                                                  const Validity& validity);
  [[nodiscard]] static Expected<Authority> open(const std::filesystem::path& folder);

  // Makes the folder NAME, or renews it; what it had before is not revoked by that. Its validity ends with the
  // authority's at the latest. Returns the folder.
  [[nodiscard]] Expected<std::filesystem::path> issue(KeyRole role, const std::string& name, const Validity& validity,
                                                      bool renew);
  // All certificates of that name. Returns how many those are that were not revoked before.
  [[nodiscard]] Expected<std::size_t> revoke(const std::string& name, std::chrono::sys_seconds now);
  // In order of name, then of their beginning.
  [[nodiscard]] Expected<std::vector<Issued>> issued() const;

  [[nodiscard]] CertificateFacts facts() const { return facts_of(*certificate_); }

 private:
  Authority(std::filesystem::path folder, openssl::Certificate certificate, openssl::Key key,
            openssl::RevocationList revoked)
      : folder_(std::move(folder)),
        certificate_(std::move(certificate)),
        key_(std::move(key)),
        revoked_(std::move(revoked)) {}

  // To the folder itself and to each that was issued.
  [[nodiscard]] Expected<void> write_revoked() const;

  std::filesystem::path folder_;
  openssl::Certificate certificate_;
  openssl::Key key_;
  openssl::RevocationList revoked_;
};

// Letters, digits, `.`, `_` and `-`, not first a dot: it is a part of a certificate and the name of a folder.
[[nodiscard]] bool is_key_name(const std::string& name);

}  // namespace perimap
