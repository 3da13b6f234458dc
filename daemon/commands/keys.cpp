// `perimap keys`: who may take part in a secured domain, and as what.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/keys/authority.hpp"
#include "daemon/keys/key_folder.hpp"
#include "daemon/keys/role.hpp"
#include "daemon/keys/security_documents.hpp"

namespace perimap {
namespace {

struct KeysOptions {
  std::filesystem::path directory = "keys";
  std::string authority = "perimap authority";
  std::string role;
  std::string name;
  int days = 365;
  int authority_days = 3650;
  bool renew = false;
  std::filesystem::path checked;
};

// Clocks of two machines differ.
Validity from_now(int days) {
  return {seconds_now() - std::chrono::minutes(5), seconds_now() + std::chrono::days(days)};
}

std::string roles_text() {
  std::string text = "Roles:";
  for (const RoleRights& rights : kRoles) text += fmt::format("\n  {:<13} {}", rights.name, rights.meaning);
  return text;
}

Outcome init(const KeysOptions& options) {
  if (options.authority.size() > 64 || options.authority.find_first_of("\n\r<>&") != std::string::npos) {
    return refuse("--name: expected a name of at most 64 bytes, without < > and &", ExitCode::kWrongUsage);
  }
  const auto made = Authority::create(options.directory, options.authority, from_now(options.authority_days));
  if (!made) return refuse(made.error());
  fmt::print(
      "{}: an authority until {}\n"
      "Its private key is in {}; who can read that can let anyone in. Keep this folder on one machine, better one "
      "without a network, and a copy in a safe.\n"
      "Next: perimap keys issue ROLE NAME for perimapd and each program that listens to it\n",
      options.directory.string(), utc_text(made->facts().validity.until),
      (options.directory / "authority/key.pem").string());
  return {};
}

Outcome issue(const KeysOptions& options) {
  const auto role = role_of_name(options.role);
  if (!role) return refuse("ROLE: expected one of those that --help names", ExitCode::kWrongUsage);
  auto authority = Authority::open(options.directory);
  if (!authority) return refuse(authority.error());
  const auto folder = authority->issue(*role, options.name, from_now(options.days), options.renew);
  if (!folder) return refuse(folder.error());
  const auto keys = check_keys(*folder, seconds_now());
  if (!keys) return refuse(keys.error());
  fmt::print("{}: keys of '{}' as {} until {}\n", folder->string(), options.name, options.role, utc_text(keys->ends));
  fmt::print(
      "Carry this folder to its machine by a way that nobody reads (it has a private key), and name it there:\n");
  switch (*role) {
    case KeyRole::kPublisher:
      fmt::print(
          "  [dds] security = \"DIRECTORY\" in perimapd's configuration; as a service:\n"
          "  chown -R root:perimap DIRECTORY && chmod 640 DIRECTORY/key.pem\n");
      break;
    default:
      fmt::print("  perimap watch --security DIRECTORY; for other programs DIRECTORY/cyclonedds.xml says how\n");
  }
  return {};
}

Outcome revoke(const KeysOptions& options) {
  auto authority = Authority::open(options.directory);
  if (!authority) return refuse(authority.error());
  const auto revoked = authority->revoke(options.name, seconds_now());
  if (!revoked) return refuse(revoked.error());
  if (*revoked == 0) {
    fmt::print("'{}' is revoked already\n", options.name);
  } else {
    fmt::print("'{}': {} certificate{} revoked\n", options.name, *revoked, *revoked == 1 ? " is" : "s are");
  }
  fmt::print(
      "Copy {} into the key folder of every machine, and start perimapd and all that listens anew: DDS reads it "
      "when a program joins, and until then goes on with whom it knows.\n",
      (options.directory / "revoked.pem").string());
  return {};
}

std::string state_of(const Issued& issued, std::chrono::sys_seconds now) {
  const Validity& v = issued.facts.validity;
  if (issued.revoked) return "REVOKED";
  if (now >= v.until) return "ENDED";
  if (now < v.from) return "not yet";
  const auto left = std::chrono::duration_cast<std::chrono::days>(v.until - now).count();
  return v.until - now < kKeysToldBefore ? fmt::format("ENDS IN {} DAYS", left) : fmt::format("{} days", left);
}

Outcome show(const KeysOptions& options) {
  const auto authority = Authority::open(options.directory);
  if (!authority) return refuse(authority.error());
  const auto all = authority->issued();
  if (!all) return refuse(all.error());
  const std::chrono::sys_seconds now = seconds_now();
  const CertificateFacts own = authority->facts();
  fmt::print("{}: authority '{}' until {}\n", options.directory.string(), own.name, utc_text(own.validity.until));
  fmt::print("{:<20} {:<13} {:<20} {:<16} {}\n", "name", "role", "until", "left", "serial");
  for (const Issued& issued : *all) {
    fmt::print("{:<20} {:<13} {:<20} {:<16} {}\n", issued.facts.name, issued.facts.role,
               utc_text(issued.facts.validity.until), state_of(issued, now), issued.facts.serial);
  }
  return {};
}

Outcome check(const KeysOptions& options, const Console& console) {
  const std::chrono::sys_seconds now = seconds_now();
  const auto keys = check_keys(options.checked, now);
  if (!keys) return refuse(keys.error());
  fmt::print("{}: keys of '{}' as {}, in order until {}\n", options.checked.string(), keys->certificate.name,
             keys->certificate.role, utc_text(keys->ends));
  if (const auto warning = expiry_warning(*keys, now)) {
    console.complain(*warning);
    return refuse("");
  }
  return {};
}

}  // namespace

void add_keys_command(Commands& commands) {
  const auto options = std::make_shared<KeysOptions>();
  Command& keys = commands.add_group("keys", "Keys for DDS Security: who may publish, who may listen");
  const auto in_directory = [&options](Command& command) {
    command.add_option("--directory", options->directory, "The authority's folder")->capture_default_str();
  };
  Command& first = commands.add(keys, "init", "Makes an authority, which lets others in",
                                [options](const Console&) { return init(*options); });
  in_directory(first);
  first.add_option("--name", options->authority, "What it is called in certificates")->capture_default_str();
  first.add_option("--days", options->authority_days, "How long it lasts; nothing that it issues lasts longer")
      ->check(Range(1, 36500))
      ->capture_default_str();
  Command& second = commands.add(keys, "issue", "Makes a folder of keys for one program",
                                 [options](const Console&) { return issue(*options); });
  in_directory(second);
  std::vector<std::string> names;
  for (const RoleRights& rights : kRoles) names.emplace_back(rights.name);
  second.add_option("ROLE", options->role, "What the program may do")->required()->check(OneOf(names));
  second.add_option("NAME", options->name, "Whose keys they are: letters, digits, '.', '_' and '-'")->required();
  second.add_option("--days", options->days, "How long they last")->check(Range(1, 36500))->capture_default_str();
  second.add_flag("--renew", options->renew, "Make new ones in place of those that are there");
  second.footer(roles_text());
  Command& third = commands.add(keys, "revoke", "Takes back all keys of that name",
                                [options](const Console&) { return revoke(*options); });
  in_directory(third);
  third.add_option("NAME", options->name, "As they were issued")->required();
  in_directory(commands.add(keys, "show", "What was issued, until when, and what is revoked",
                            [options](const Console&) { return show(*options); }));
  commands
      .add(keys, "check",
           "Whether a program's keys are in order; ends with 1 when they are not, or end within four weeks",
           [options](const Console& console) { return check(*options, console); })
      .add_option("FOLDER", options->checked, "As perimap keys issue makes it")
      ->required();
}

}  // namespace perimap
