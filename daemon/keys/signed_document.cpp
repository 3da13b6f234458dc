#include "daemon/keys/signed_document.hpp"

#include <openssl/pem.h>

namespace perimap {

Expected<std::string> sign_document(std::string_view document, X509& signer, EVP_PKEY& key) {
  constexpr int kFlags = PKCS7_DETACHED | PKCS7_TEXT | PKCS7_STREAM;
  const openssl::Bio in = openssl::memory(document);
  const openssl::SignedMessage message(PKCS7_sign(&signer, &key, nullptr, in.get(), kFlags));
  if (!message) return openssl::failure("a document cannot be signed");
  const openssl::Bio out = openssl::memory();
  if (SMIME_write_PKCS7(out.get(), message.get(), in.get(), kFlags) != 1) {
    return openssl::failure("a signed document cannot be written");
  }
  return openssl::text_of(out);
}

Expected<std::string> verified_document(std::string_view message, X509& authority, const std::string& told_as) {
  const openssl::Bio in = openssl::memory(message);
  BIO* content = nullptr;
  const openssl::SignedMessage signed_message(SMIME_read_PKCS7(in.get(), &content));
  const openssl::Bio clear(content);
  if (!signed_message) return openssl::failure(told_as + ": expected a document with its signature (S/MIME)");
  const openssl::Store store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), &authority);
  // Whether the authority's own certificate has expired is told by itself.
  X509_STORE_set_flags(store.get(), X509_V_FLAG_NO_CHECK_TIME);
  // By the authority itself: whom it has let in must not sign in its name, whatever the message brings along.
  const openssl::Certificates signers(sk_X509_new_null());
  if (!signers || sk_X509_push(signers.get(), &authority) <= 0) return openssl::failure(told_as);
  const openssl::Bio document = openssl::memory();
  if (PKCS7_verify(signed_message.get(), signers.get(), store.get(), clear.get(), document.get(),
                   PKCS7_TEXT | PKCS7_NOINTERN) != 1) {
    return openssl::failure(told_as + ": is not signed by this authority, or was changed since");
  }
  return openssl::text_of(document);
}

}  // namespace perimap
