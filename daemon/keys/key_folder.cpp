#include "daemon/keys/key_folder.hpp"

#include <fmt/format.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <system_error>

#include "daemon/dds/security.hpp"
#include "daemon/keys/key_digests.hpp"
#include "daemon/keys/signed_document.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
namespace files = dds::key_files;

constexpr std::size_t kLargestFile = std::size_t{1} << 20U;

Expected<std::string> read(const fs::path& file, std::string_view what) {
  auto text = read_text_file(file, kLargestFile, what);
  if (text && text->size() > kLargestFile) {
    return fail(fmt::format("{}: expected a {} of at most {} bytes", file.string(), what, kLargestFile));
  }
  return text;
}

// What a chain of two and the list of what is revoked come to at `now`; empty when the certificate holds.
std::string refusal(X509& certificate, X509& authority, X509_CRL& revoked, std::chrono::sys_seconds now) {
  const openssl::Store store(X509_STORE_new());
  const openssl::StoreContext context(X509_STORE_CTX_new());
  if (!store || !context || X509_STORE_add_cert(store.get(), &authority) != 1 ||
      X509_STORE_add_crl(store.get(), &revoked) != 1 ||
      X509_STORE_CTX_init(context.get(), store.get(), &certificate, nullptr) != 1) {
    return "OpenSSL cannot look at it";
  }
  X509_STORE_CTX_set_flags(context.get(), X509_V_FLAG_CRL_CHECK);
  X509_STORE_CTX_set_time(context.get(), 0, std::chrono::system_clock::to_time_t(now));
  if (X509_verify_cert(context.get()) == 1) return {};
  const CertificateFacts facts = facts_of(certificate);
  switch (X509_STORE_CTX_get_error(context.get())) {
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return fmt::format("has expired: it or its authority ended before {}", utc_text(now));
    case X509_V_ERR_CERT_NOT_YET_VALID:
    case X509_V_ERR_CRL_NOT_YET_VALID:
      return fmt::format("holds from {} on; this machine's clock says {}", utc_text(facts.validity.from),
                         utc_text(now));
    case X509_V_ERR_CERT_REVOKED:
      return "is revoked";
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_CERT_SIGNATURE_FAILURE:
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
      return "is not of the authority beside it";
    case X509_V_ERR_UNABLE_TO_GET_CRL:
    case X509_V_ERR_CRL_SIGNATURE_FAILURE:
      return std::string("cannot be looked up: ") + files::kRevoked + " is of another authority";
    default:
      return X509_verify_cert_error_string(X509_STORE_CTX_get_error(context.get()));
  }
}

}  // namespace

Expected<KeyFacts> check_keys(const fs::path& folder, std::chrono::sys_seconds now) {
  const auto in = [&folder](const char* name) { return (folder / name).string(); };
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return fail(fmt::format("{}: expected a folder of keys (perimap keys issue makes one)", folder.string()));
  }
  const auto authority_pem = read(in(files::kAuthority), "authority's certificate");
  if (!authority_pem) return tl::unexpected(authority_pem.error());
  const auto authority = parse_certificate(*authority_pem, in(files::kAuthority));
  if (!authority) return tl::unexpected(authority.error());
  const auto pem = read(in(files::kCertificate), "certificate");
  if (!pem) return tl::unexpected(pem.error());
  const auto certificate = parse_certificate(*pem, in(files::kCertificate));
  if (!certificate) return tl::unexpected(certificate.error());
  const auto list_pem = read(in(files::kRevoked), "list of revoked certificates");
  if (!list_pem) return tl::unexpected(list_pem.error());
  const auto revoked = parse_revocations(*list_pem, in(files::kRevoked));
  if (!revoked) return tl::unexpected(revoked.error());
  if (const std::string why = refusal(**certificate, **authority, **revoked, now); !why.empty()) {
    return fail(fmt::format("{}: {}", in(files::kCertificate), why));
  }
  const auto key_pem = read(in(files::kKey), "private key");
  if (!key_pem) return tl::unexpected(key_pem.error());
  const auto key = parse_key(*key_pem, in(files::kKey));
  if (!key) return tl::unexpected(key.error());
  if (X509_check_private_key(certificate->get(), key->get()) != 1) {
    return openssl::failure(in(files::kKey) + ": is not the key of the certificate beside it");
  }
  const fs::perms mode = fs::status(in(files::kKey), error).permissions();
  if ((mode & (fs::perms::others_all | fs::perms::group_write)) != fs::perms::none) {
    return fail(in(files::kKey) + ": others may read it; expected mode 0600, or 0640 with the service's group");
  }
  const auto governance = read(in(files::kGovernance), "governance document").and_then([&](const std::string& message) {
    return verified_document(message, **authority, in(files::kGovernance));
  });
  if (!governance) return tl::unexpected(governance.error());
  const auto permissions =
      read(in(files::kPermissions), "permissions document").and_then([&](const std::string& message) {
        return verified_document(message, **authority, in(files::kPermissions));
      });
  if (!permissions) return tl::unexpected(permissions.error());
  const CertificateFacts facts = facts_of(**certificate);
  if (permissions->find(fmt::format("<subject_name>{}</subject_name>", facts.subject)) == std::string::npos) {
    return fail(in(files::kPermissions) + ": is of another certificate than the one beside it");
  }
  if (const auto whole = check_key_digests(folder); !whole) return tl::unexpected(whole.error());
  return KeyFacts{facts, std::min(facts.validity.until, facts_of(**authority).validity.until)};
}

std::optional<std::string> expiry_warning(const KeyFacts& keys, std::chrono::sys_seconds now) {
  if (!keys.ends_soon(now)) return std::nullopt;
  if (now >= keys.ends) {
    return fmt::format(
        "keys of '{}' ({}) have ended {}: DDS has taken this program out of the domain, and nothing is published or "
        "received any more. Put new keys in their place and start it anew",
        keys.certificate.name, keys.certificate.role, utc_text(keys.ends));
  }
  return fmt::format("keys of '{}' ({}) end {}, in {} days: issue new ones in time (perimap keys issue --renew)",
                     keys.certificate.name, keys.certificate.role, utc_text(keys.ends),
                     std::chrono::duration_cast<std::chrono::days>(keys.ends - now).count());
}

}  // namespace perimap
