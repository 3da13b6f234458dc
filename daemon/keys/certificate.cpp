#include "daemon/keys/certificate.hpp"

#include <fmt/format.h>
#include <openssl/pem.h>

#include <array>
#include <ctime>

namespace perimap {
namespace {

std::string entry(const X509& certificate, int nid) {
  std::array<char, 256> text{};
  const X509_NAME* name = X509_get_subject_name(&certificate);
  const int n = X509_NAME_get_text_by_NID(name, nid, text.data(), static_cast<int>(text.size()));
  return n > 0 ? std::string(text.data(), static_cast<std::size_t>(n)) : std::string();
}

// 1970 where it is no time that is known.
std::chrono::sys_seconds instant_of(const ASN1_TIME* time) {
  std::tm parts{};
  if (time == nullptr || ASN1_TIME_to_tm(time, &parts) != 1) return {};
  return std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::from_time_t(timegm(&parts)));
}

// Never asks anyone for a passphrase.
int no_passphrase(char* /*buffer*/, int /*size*/, int /*writing*/, void* /*user*/) { return -1; }

}  // namespace

Expected<openssl::Certificate> parse_certificate(std::string_view pem, const std::string& told_as) {
  const openssl::Bio bio = openssl::memory(pem);
  openssl::Certificate certificate(PEM_read_bio_X509(bio.get(), nullptr, &no_passphrase, nullptr));
  if (!certificate) return openssl::failure(told_as + ": expected a certificate (PEM)");
  return certificate;
}

Expected<openssl::Key> parse_key(std::string_view pem, const std::string& told_as) {
  const openssl::Bio bio = openssl::memory(pem);
  openssl::Key key(PEM_read_bio_PrivateKey(bio.get(), nullptr, &no_passphrase, nullptr));
  if (!key) return openssl::failure(told_as + ": expected a private key without a passphrase (PEM)");
  return key;
}

Expected<openssl::RevocationList> parse_revocations(std::string_view pem, const std::string& told_as) {
  const openssl::Bio bio = openssl::memory(pem);
  openssl::RevocationList list(PEM_read_bio_X509_CRL(bio.get(), nullptr, &no_passphrase, nullptr));
  if (!list) return openssl::failure(told_as + ": expected a list of revoked certificates (PEM)");
  // It is replaced by itself and has no digest; readers of PEM pass over other line ends, bits that fill the last
  // character, and what stands around it.
  const auto written = to_pem(*list);
  if (!written) return tl::unexpected(written.error());
  if (*written != pem) return fail(told_as + ": is not as perimap keys wrote it: a byte is another, or is too many");
  return list;
}

CertificateFacts facts_of(const X509& certificate) {
  CertificateFacts facts;
  facts.name = entry(certificate, NID_commonName);
  facts.role = entry(certificate, NID_organizationalUnitName);
  const openssl::Bio subject = openssl::memory();
  X509_NAME_print_ex(subject.get(), X509_get_subject_name(&certificate), 0, XN_FLAG_RFC2253);
  facts.subject = openssl::text_of(subject);
  const openssl::Number serial(ASN1_INTEGER_to_BN(X509_get0_serialNumber(&certificate), nullptr));
  if (serial) {
    char* text = BN_bn2hex(serial.get());
    if (text != nullptr) facts.serial = text;
    OPENSSL_free(text);
  }
  facts.validity = {instant_of(X509_get0_notBefore(&certificate)), instant_of(X509_get0_notAfter(&certificate))};
  return facts;
}

Expected<std::string> to_pem(const X509& certificate) {
  const openssl::Bio bio = openssl::memory();
  if (PEM_write_bio_X509(bio.get(), &certificate) != 1) return openssl::failure("a certificate cannot be written");
  return openssl::text_of(bio);
}

Expected<std::string> to_pem(const EVP_PKEY& key) {
  const openssl::Bio bio = openssl::memory();
  if (PEM_write_bio_PrivateKey(bio.get(), &key, nullptr, nullptr, 0, nullptr, nullptr) != 1) {
    return openssl::failure("a private key cannot be written");
  }
  return openssl::text_of(bio);
}

Expected<std::string> to_pem(const X509_CRL& revocations) {
  const openssl::Bio bio = openssl::memory();
  if (PEM_write_bio_X509_CRL(bio.get(), &revocations) != 1) {
    return openssl::failure("a list of revoked certificates cannot be written");
  }
  return openssl::text_of(bio);
}

}  // namespace perimap
