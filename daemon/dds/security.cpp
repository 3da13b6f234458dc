#include "daemon/dds/security.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <system_error>

namespace perimap::dds {

std::string plugin_path(const std::string& plugin) {
  std::string file = fmt::format("libdds_security_{}.so", plugin);
  Dl_info here{};
  if (dladdr(reinterpret_cast<const void*>(&dds_create_participant), &here) == 0 || here.dli_fname == nullptr) {
    return file;
  }
  std::error_code error;
  const auto library = std::filesystem::canonical(here.dli_fname, error);
  const auto beside = library.parent_path() / "libddsc0debian" / file;
  return !error && std::filesystem::exists(beside, error) ? beside.string() : file;
}

Qos secured_qos(const std::filesystem::path& keys) {
  Qos qos(dds_create_qos());
  const auto set = [&qos](const char* name, const std::string& value) {
    dds_qset_prop(qos.get(), name, value.c_str());
  };
  const auto file = [&keys](const char* name) { return "file:" + (keys / name).string(); };
  set("dds.sec.auth.library.path", plugin_path("auth"));
  set("dds.sec.auth.library.init", "init_authentication");
  set("dds.sec.auth.library.finalize", "finalize_authentication");
  set("dds.sec.access.library.path", plugin_path("ac"));
  set("dds.sec.access.library.init", "init_access_control");
  set("dds.sec.access.library.finalize", "finalize_access_control");
  set("dds.sec.crypto.library.path", plugin_path("crypto"));
  set("dds.sec.crypto.library.init", "init_crypto");
  set("dds.sec.crypto.library.finalize", "finalize_crypto");
  set("dds.sec.auth.identity_ca", file(key_files::kAuthority));
  set("dds.sec.auth.identity_certificate", file(key_files::kCertificate));
  set("dds.sec.auth.private_key", file(key_files::kKey));
  set("org.eclipse.cyclonedds.sec.auth.crl", file(key_files::kRevoked));
  set("dds.sec.access.permissions_ca", file(key_files::kAuthority));
  set("dds.sec.access.governance", file(key_files::kGovernance));
  set("dds.sec.access.permissions", file(key_files::kPermissions));
  return qos;
}

}  // namespace perimap::dds
