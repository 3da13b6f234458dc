// Ownership of OpenSSL's objects, and what went wrong in it.
#pragma once

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include <memory>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"

namespace perimap::openssl {

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* object) const noexcept {
    kFree(object);
  }
};

using Bio = std::unique_ptr<BIO, Free<&BIO_free_all>>;
using Key = std::unique_ptr<EVP_PKEY, Free<&EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Free<&X509_free>>;
using RevocationList = std::unique_ptr<X509_CRL, Free<&X509_CRL_free>>;
using Store = std::unique_ptr<X509_STORE, Free<&X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Free<&X509_STORE_CTX_free>>;
using SignedMessage = std::unique_ptr<PKCS7, Free<&PKCS7_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Free<&X509_EXTENSION_free>>;
using Revoked = std::unique_ptr<X509_REVOKED, Free<&X509_REVOKED_free>>;
using Number = std::unique_ptr<BIGNUM, Free<&BN_free>>;
// Not of the certificates in it.
struct FreeList {
  void operator()(STACK_OF(X509) * list) const noexcept { sk_X509_free(list); }
};
using Certificates = std::unique_ptr<STACK_OF(X509), FreeList>;
using Time = std::unique_ptr<ASN1_TIME, Free<&ASN1_TIME_free>>;

// Of the call before, in OpenSSL's words.
[[nodiscard]] inline tl::unexpected<Error> failure(std::string_view what) {
  const unsigned long code = ERR_peek_last_error();
  const char* reason = code == 0 ? nullptr : ERR_reason_error_string(code);
  ERR_clear_error();
  return fail(fmt::format("{}: {}", what, reason == nullptr ? "OpenSSL does not say why" : reason));
}

[[nodiscard]] inline Bio memory() { return Bio(BIO_new(BIO_s_mem())); }
[[nodiscard]] inline Bio memory(std::string_view text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}
[[nodiscard]] inline std::string text_of(const Bio& bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}

}  // namespace perimap::openssl
