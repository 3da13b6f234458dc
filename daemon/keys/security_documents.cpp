#include "daemon/keys/security_documents.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <span>

namespace perimap {
namespace {

// As many domains as a configuration may name.
constexpr std::string_view kDomains =
    "      <domains>\n"
    "        <id_range>\n"
    "          <min>0</min>\n"
    "          <max>230</max>\n"
    "        </id_range>\n"
    "      </domains>\n";

constexpr std::string_view kHead = R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-Security/20170901/{}.xsd">
)";

std::string topics(std::string_view what, std::span<const std::string_view> names) {
  std::string text;
  for (const std::string_view name : names) {
    if (!name.empty()) text += fmt::format("            <topic>{}</topic>\n", name);
  }
  if (text.empty()) return {};
  return fmt::format("        <{0}>\n          <topics>\n{1}          </topics>\n        </{0}>\n", what, text);
}

}  // namespace

std::string utc_text(std::chrono::sys_seconds t) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(t)));
}

std::string governance_xml() {
  return fmt::format(fmt::runtime(kHead), "omg_shared_ca_governance") +
         "  <domain_access_rules>\n"
         "    <domain_rule>\n" +
         std::string(kDomains) +
         "      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
         "      <enable_join_access_control>true</enable_join_access_control>\n"
         "      <discovery_protection_kind>ENCRYPT_WITH_ORIGIN_AUTHENTICATION</discovery_protection_kind>\n"
         "      <liveliness_protection_kind>ENCRYPT_WITH_ORIGIN_AUTHENTICATION</liveliness_protection_kind>\n"
         "      <rtps_protection_kind>ENCRYPT_WITH_ORIGIN_AUTHENTICATION</rtps_protection_kind>\n"
         "      <topic_access_rules>\n"
         "        <topic_rule>\n"
         "          <topic_expression>*</topic_expression>\n"
         "          <enable_discovery_protection>true</enable_discovery_protection>\n"
         "          <enable_liveliness_protection>true</enable_liveliness_protection>\n"
         "          <enable_read_access_control>true</enable_read_access_control>\n"
         "          <enable_write_access_control>true</enable_write_access_control>\n"
         "          <metadata_protection_kind>NONE</metadata_protection_kind>\n"
         "          <data_protection_kind>NONE</data_protection_kind>\n"
         "        </topic_rule>\n"
         "      </topic_access_rules>\n"
         "    </domain_rule>\n"
         "  </domain_access_rules>\n"
         "</dds>\n";
}

std::string permissions_xml(std::string_view name, std::string_view subject, const RoleRights& rights,
                            const Validity& validity) {
  return fmt::format(fmt::runtime(kHead), "omg_shared_ca_permissions") +
         fmt::format(
             "  <permissions>\n"
             "    <grant name=\"{}\">\n"
             "      <subject_name>{}</subject_name>\n"
             "      <validity>\n"
             "        <not_before>{}</not_before>\n"
             "        <not_after>{}</not_after>\n"
             "      </validity>\n"
             "      <allow_rule>\n{}{}{}"
             "      </allow_rule>\n"
             "      <default>DENY</default>\n"
             "    </grant>\n"
             "  </permissions>\n"
             "</dds>\n",
             name, subject, utc_text(validity.from), utc_text(validity.until), kDomains,
             topics("publish", rights.publishes), topics("subscribe", rights.subscribes));
}

}  // namespace perimap
