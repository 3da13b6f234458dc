#include "daemon/keys/authority.hpp"

#include <fmt/format.h>
#include <openssl/ec.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <system_error>
#include <utility>

#include "daemon/dds/security.hpp"
#include "daemon/keys/key_digests.hpp"
#include "daemon/keys/signed_document.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using Readers = WholeFile::Readers;

constexpr std::size_t kLargestFile = std::size_t{1} << 20U;
constexpr const char* kOwnFolder = "authority";
constexpr const char* kOwnKey = "key.pem";
constexpr const char* kOwnCertificate = "certificate.pem";
constexpr const char* kIssued = "issued";

openssl::Time asn1_time(std::chrono::sys_seconds t) {
  return openssl::Time(ASN1_TIME_set(nullptr, std::chrono::system_clock::to_time_t(t)));
}

// What a certificate is to say beside whose it is.
struct Wanted {
  std::string name;
  std::string role;
  Validity validity;
  bool authority = false;
};

bool add_extension(X509& certificate, X509& issuer, int nid, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, &issuer, &certificate, nullptr, nullptr, 0);
  const openssl::Extension extension(X509V3_EXT_conf_nid(nullptr, &context, nid, value));
  return extension && X509_add_ext(&certificate, extension.get(), -1) == 1;
}

bool add_entry(X509_NAME& name, const char* field, const std::string& value) {
  return X509_NAME_add_entry_by_txt(&name, field, MBSTRING_ASC, reinterpret_cast<const unsigned char*>(value.c_str()),
                                    -1, -1, 0) == 1;
}

// 127 random bits.
bool draw_serial(X509& certificate) {
  std::array<unsigned char, 16> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) return false;
  bytes[0] = static_cast<unsigned char>((bytes[0] & 0x7FU) | 0x40U);
  const openssl::Number number(BN_bin2bn(bytes.data(), static_cast<int>(bytes.size()), nullptr));
  return number && BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(&certificate)) != nullptr;
}

// `issuer`: none signs itself.
Expected<openssl::Certificate> make_certificate(const Wanted& wanted, EVP_PKEY& key, X509* issuer,
                                                EVP_PKEY& issuer_key) {
  openssl::Certificate made(X509_new());
  if (!made) return openssl::failure("a certificate cannot be made");
  X509& certificate = *made;
  X509& by = issuer == nullptr ? certificate : *issuer;
  X509_NAME* subject = X509_get_subject_name(&certificate);
  bool well = X509_set_version(&certificate, 2) == 1 && draw_serial(certificate) &&
              add_entry(*subject, "O", "perimap") && add_entry(*subject, "OU", wanted.role) &&
              add_entry(*subject, "CN", wanted.name) &&
              X509_set_issuer_name(&certificate, X509_get_subject_name(&by)) == 1 &&
              X509_set1_notBefore(&certificate, asn1_time(wanted.validity.from).get()) == 1 &&
              X509_set1_notAfter(&certificate, asn1_time(wanted.validity.until).get()) == 1 &&
              X509_set_pubkey(&certificate, &key) == 1;
  const std::initializer_list<std::pair<int, const char*>> of_authority = {
      {NID_basic_constraints, "critical,CA:TRUE"},
      {NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature"},
      {NID_subject_key_identifier, "hash"}};
  const std::initializer_list<std::pair<int, const char*>> of_others = {
      {NID_basic_constraints, "critical,CA:FALSE"},
      {NID_key_usage, "critical,digitalSignature,keyAgreement"},
      {NID_subject_key_identifier, "hash"},
      {NID_authority_key_identifier, "keyid:always"}};
  for (const auto& [nid, value] : wanted.authority ? of_authority : of_others) {
    well = well && add_extension(certificate, by, nid, value);
  }
  if (!well || X509_sign(&certificate, &issuer_key, EVP_sha256()) == 0) {
    return openssl::failure("a certificate cannot be made");
  }
  return made;
}

bool sign_revocations(X509_CRL& list, EVP_PKEY& key) {
  return X509_CRL_sort(&list) == 1 && X509_CRL_sign(&list, &key, EVP_sha256()) > 0;
}

// Empty; it holds as long as the authority does, since nobody renews it by a clock.
Expected<openssl::RevocationList> make_revocations(X509& authority, EVP_PKEY& key, const Validity& validity) {
  openssl::RevocationList list(X509_CRL_new());
  const bool well = list && X509_CRL_set_version(list.get(), 1) == 1 &&
                    X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(&authority)) == 1 &&
                    X509_CRL_set1_lastUpdate(list.get(), asn1_time(validity.from).get()) == 1 &&
                    X509_CRL_set1_nextUpdate(list.get(), asn1_time(validity.until).get()) == 1 &&
                    sign_revocations(*list, key);
  if (!well) return openssl::failure("a list of revoked certificates cannot be made");
  return list;
}

Expected<openssl::Key> make_key() {
  openssl::Key key(EVP_EC_gen("P-256"));
  if (!key) return openssl::failure("a key cannot be made");
  return key;
}

bool is_revoked(X509_CRL& list, X509& certificate) {
  X509_REVOKED* entry = nullptr;
  return X509_CRL_get0_by_cert(&list, &entry, &certificate) == 1;
}

Expected<void> make_folder(const fs::path& folder, fs::perms mode) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error) fs::permissions(folder, mode, error);
  if (error) return fail(fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
  return {};
}

Expected<std::string> read(const fs::path& file, std::string_view what) {
  return read_text_file(file, kLargestFile, what);
}

struct CertificateFile {
  fs::path file;
  openssl::Certificate certificate;
};

// All that were issued.
Expected<std::vector<CertificateFile>> read_issued(const fs::path& folder) {
  std::vector<CertificateFile> all;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".pem") continue;
    const auto pem = read(entry.path(), "certificate");
    if (!pem) return tl::unexpected(pem.error());
    auto certificate = parse_certificate(*pem, entry.path().string());
    if (!certificate) return tl::unexpected(certificate.error());
    all.push_back({entry.path(), *std::move(certificate)});
  }
  if (error) return fail(fmt::format("{}: {}", folder.string(), error.message()));
  return all;
}

// For programs that know nothing of perimap's configuration.
std::string cyclonedds_xml() {
  const auto library = [](const char* element, const char* plugin, const char* name) {
    return fmt::format("        <Library path=\"{0}\" initFunction=\"init_{1}\" finalizeFunction=\"finalize_{1}\"/>\n",
                       dds::plugin_path(plugin), name, element);
  };
  const auto file = [](const char* element, const char* name) {
    return fmt::format("        <{0}>file:${{PERIMAP_KEYS}}/{1}</{0}>\n", element, name);
  };
  namespace files = dds::key_files;
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<!-- For a subscriber that is no program of perimap's: export PERIMAP_KEYS, the absolute path of this "
         "folder, "
         "and add this file to CYCLONEDDS_URI after a comma. -->\n"
         "<CycloneDDS xmlns=\"https://cdds.io/config\">\n  <Domain Id=\"any\">\n    <Security>\n      "
         "<Authentication>\n" +
         library("Authentication", "auth", "authentication") + file("IdentityCA", files::kAuthority) +
         file("IdentityCertificate", files::kCertificate) + file("PrivateKey", files::kKey) +
         file("CRL", files::kRevoked) + "      </Authentication>\n      <AccessControl>\n" +
         library("AccessControl", "ac", "access_control") + file("PermissionsCA", files::kAuthority) +
         file("Governance", files::kGovernance) + file("Permissions", files::kPermissions) +
         "      </AccessControl>\n      <Cryptographic>\n" + library("Cryptographic", "crypto", "crypto") +
         "      </Cryptographic>\n    </Security>\n  </Domain>\n</CycloneDDS>\n";
}

}  // namespace

bool is_key_name(const std::string& name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  };
  return !name.empty() && name.size() <= 48 && name.front() != '.' && name.front() != '-' && name != kOwnFolder &&
         std::all_of(name.begin(), name.end(), good);
}

Expected<Authority> Authority::create(const fs::path& folder, const std::string& name, const Validity& validity) {
  std::error_code error;
  const fs::path own = folder / kOwnFolder;
  if (fs::exists(own, error)) return fail(fmt::format("{}: there is an authority already", own.string()));
  auto key = make_key();
  if (!key) return tl::unexpected(key.error());
  auto certificate = make_certificate({name, "authority", validity, true}, **key, nullptr, **key);
  if (!certificate) return tl::unexpected(certificate.error());
  auto revoked = make_revocations(**certificate, **key, validity);
  if (!revoked) return tl::unexpected(revoked.error());
  const auto key_pem = to_pem(**key);
  if (!key_pem) return tl::unexpected(key_pem.error());
  const auto certificate_pem = to_pem(**certificate);
  if (!certificate_pem) return tl::unexpected(certificate_pem.error());
  Authority authority(folder, std::move(*certificate), std::move(*key), std::move(*revoked));
  const Expected<void> written =
      make_folder(own / kIssued, fs::perms::owner_all)
          .and_then([&] { return make_folder(own, fs::perms::owner_all); })
          .and_then([&] { return write_text_file(own / kOwnKey, *key_pem, Readers::kOwner); })
          .and_then([&] { return write_text_file(own / kOwnCertificate, *certificate_pem); })
          .and_then([&] { return authority.write_revoked(); });
  if (!written) return tl::unexpected(written.error());
  return authority;
}

Expected<Authority> Authority::open(const fs::path& folder) {
  const fs::path own = folder / kOwnFolder;
  const auto key_pem = read(own / kOwnKey, "authority's private key (perimap keys init makes one)");
  if (!key_pem) return tl::unexpected(key_pem.error());
  auto key = parse_key(*key_pem, (own / kOwnKey).string());
  if (!key) return tl::unexpected(key.error());
  const auto certificate_pem = read(own / kOwnCertificate, "authority's certificate");
  if (!certificate_pem) return tl::unexpected(certificate_pem.error());
  auto certificate = parse_certificate(*certificate_pem, (own / kOwnCertificate).string());
  if (!certificate) return tl::unexpected(certificate.error());
  if (X509_check_private_key(certificate->get(), key->get()) != 1) {
    return openssl::failure((own / kOwnKey).string() + ": is not the key of the certificate beside it");
  }
  const fs::path list = folder / dds::key_files::kRevoked;
  const auto list_pem = read(list, "list of revoked certificates");
  if (!list_pem) return tl::unexpected(list_pem.error());
  auto revoked = parse_revocations(*list_pem, list.string());
  if (!revoked) return tl::unexpected(revoked.error());
  // What another has put there would be signed anew with the next revocation.
  if (X509_CRL_verify(revoked->get(), key->get()) != 1) {
    return openssl::failure(list.string() + ": is not signed by this authority, or was changed since");
  }
  return Authority(folder, std::move(*certificate), std::move(*key), std::move(*revoked));
}

Expected<fs::path> Authority::issue(KeyRole role, const std::string& name, const Validity& validity, bool renew) {
  if (!is_key_name(name)) {
    return fail(fmt::format("'{}': expected a name of 1 to 48 letters, digits, '.', '_' and '-'", name));
  }
  const fs::path folder = folder_ / name;
  std::error_code error;
  if (fs::exists(folder, error) && !renew) {
    return fail(fmt::format("{}: is there already (--renew makes new keys there)", folder.string()));
  }
  const RoleRights& rights = rights_of(role);
  const auto before = fs::exists(folder, error) ? issued() : std::vector<Issued>();
  if (!before) return tl::unexpected(before.error());
  for (const Issued& one : *before) {
    // What it could do before it could go on to do.
    if (one.facts.name == name && one.facts.role != rights.name && !one.revoked &&
        one.facts.validity.until > validity.from) {
      return fail(fmt::format("'{}': has keys of a {} that hold; revoke them first (perimap keys revoke {})", name,
                              one.facts.role, name));
    }
  }
  const Validity own = facts().validity;
  if (validity.from >= own.until) return fail(fmt::format("the authority itself has ended {}", utc_text(own.until)));
  const Validity held{validity.from, std::min(validity.until, own.until)};
  auto key = make_key();
  if (!key) return tl::unexpected(key.error());
  auto certificate = make_certificate({name, std::string(rights.name), held, false}, **key, certificate_.get(), *key_);
  if (!certificate) return tl::unexpected(certificate.error());
  const CertificateFacts made = facts_of(**certificate);
  const auto pem = to_pem(**certificate);
  const auto key_pem = to_pem(**key);
  const auto authority_pem = to_pem(*certificate_);
  const auto list_pem = to_pem(*revoked_);
  const auto governance = sign_document(governance_xml(), *certificate_, *key_);
  const auto permissions = sign_document(permissions_xml(name, made.subject, rights, held), *certificate_, *key_);
  for (const auto* text : {&pem, &key_pem, &authority_pem, &list_pem, &governance, &permissions}) {
    if (!*text) return tl::unexpected(text->error());
  }
  namespace files = dds::key_files;
  // First the register: what is not in it could not be revoked.
  const fs::path entry = folder_ / kOwnFolder / kIssued / (made.serial + ".pem");
  const Expected<void> written =
      write_text_file(entry, *pem)
          .and_then(
              [&] { return make_folder(folder, fs::perms::owner_all | fs::perms::group_read | fs::perms::group_exec); })
          .and_then([&] { return write_text_file(folder / files::kKey, *key_pem, Readers::kOwner); })
          .and_then([&] { return write_text_file(folder / files::kCertificate, *pem); })
          .and_then([&] { return write_text_file(folder / files::kAuthority, *authority_pem); })
          .and_then([&] { return write_text_file(folder / files::kRevoked, *list_pem); })
          .and_then([&] { return write_text_file(folder / files::kGovernance, *governance); })
          .and_then([&] { return write_text_file(folder / files::kPermissions, *permissions); })
          .and_then([&] {
            return write_text_file(folder / kKeyDigests, key_digests({{files::kAuthority, *authority_pem},
                                                                      {files::kCertificate, *pem},
                                                                      {files::kKey, *key_pem},
                                                                      {files::kGovernance, *governance},
                                                                      {files::kPermissions, *permissions}}));
          })
          .and_then([&] { return write_text_file(folder / "cyclonedds.xml", cyclonedds_xml()); });
  if (!written) return tl::unexpected(written.error());
  return folder;
}

Expected<std::size_t> Authority::revoke(const std::string& name, std::chrono::sys_seconds now) {
  const auto certificates = read_issued(folder_ / kOwnFolder / kIssued);
  if (!certificates) return tl::unexpected(certificates.error());
  std::size_t known = 0;
  std::size_t added = 0;
  for (const auto& [file, certificate] : *certificates) {
    if (facts_of(*certificate).name != name) continue;
    ++known;
    if (is_revoked(*revoked_, *certificate)) continue;
    openssl::Revoked entry(X509_REVOKED_new());
    const bool well = entry &&
                      X509_REVOKED_set_serialNumber(entry.get(), X509_get_serialNumber(certificate.get())) == 1 &&
                      X509_REVOKED_set_revocationDate(entry.get(), asn1_time(now).get()) == 1 &&
                      X509_CRL_add0_revoked(revoked_.get(), entry.get()) == 1;
    if (!well) return openssl::failure(file.string() + ": cannot be revoked");
    static_cast<void>(entry.release());  // the list's now
    ++added;
  }
  if (known == 0)
    return fail(fmt::format("'{}': nothing was issued under this name (perimap keys show tells what was)", name));
  // Written all the same: the time before it may not have come to an end.
  if (added == 0) return write_revoked().map([] { return std::size_t{0}; });
  // Clocks of two machines differ.
  if (X509_CRL_set1_lastUpdate(revoked_.get(), asn1_time(now - std::chrono::minutes(5)).get()) != 1 ||
      !sign_revocations(*revoked_, *key_)) {
    return openssl::failure("the list of revoked certificates cannot be signed");
  }
  return write_revoked().map([added] { return added; });
}

Expected<std::vector<Issued>> Authority::issued() const {
  const auto certificates = read_issued(folder_ / kOwnFolder / kIssued);
  if (!certificates) return tl::unexpected(certificates.error());
  std::vector<Issued> all;
  for (const auto& [file, certificate] : *certificates) {
    all.push_back({facts_of(*certificate), is_revoked(*revoked_, *certificate)});
  }
  std::sort(all.begin(), all.end(), [](const Issued& a, const Issued& b) {
    return std::pair(a.facts.name, a.facts.validity.from) < std::pair(b.facts.name, b.facts.validity.from);
  });
  return all;
}

Expected<void> Authority::write_revoked() const {
  const auto pem = to_pem(*revoked_);
  if (!pem) return tl::unexpected(pem.error());
  Expected<void> written = write_text_file(folder_ / dds::key_files::kRevoked, *pem);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    const fs::path list = entry.path() / dds::key_files::kRevoked;
    std::error_code ignored;
    if (written && fs::exists(list, ignored)) written = write_text_file(list, *pem);
  }
  if (error) return fail(fmt::format("{}: {}", folder_.string(), error.message()));
  return written;
}

}  // namespace perimap
