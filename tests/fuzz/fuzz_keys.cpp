// Any bytes as the files of a key folder, kind by kind, and as a signed document of an authority: nothing is ever taken
// for signed, since nobody here has its key.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/keys/certificate.hpp"
#include "daemon/keys/signed_document.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string name = "fuzzed";
  switch (data[0] % 4) {
    case 0:
      if (const auto certificate = parse_certificate(text, name)) {
        static_cast<void>(facts_of(**certificate));
        static_cast<void>(to_pem(**certificate));
      }
      break;
    case 1:
      static_cast<void>(parse_key(text, name));
      break;
    case 2:
      static_cast<void>(parse_revocations(text, name));
      break;
    default: {
      // An empty certificate has no key that could have signed anything.
      static const openssl::Certificate authority(X509_new());
      if (verified_document(text, *authority, name)) std::abort();
    }
  }
  return 0;
}
