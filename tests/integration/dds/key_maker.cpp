// Keys for the tests of a secured domain, with any validity.
//   key_maker DIRECTORY init
//   key_maker DIRECTORY issue ROLE NAME SECONDS
//   key_maker DIRECTORY revoke NAME
//   key_maker FOLDER check
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "daemon/keys/authority.hpp"
#include "daemon/keys/key_folder.hpp"

namespace {

using perimap::Authority;

int told(const perimap::Error& error) {
  (void)std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

int run(const std::vector<std::string>& words) {
  if (words.size() < 2) return 2;
  const auto now = perimap::seconds_now();
  const perimap::Validity long_ago_to_soon{now - std::chrono::minutes(5), now + std::chrono::days(30)};
  if (words[1] == "init") {
    const auto made = Authority::create(words[0], "test", long_ago_to_soon);
    return made ? 0 : told(made.error());
  }
  if (words[1] == "check") {
    const auto checked = perimap::check_keys(words[0], now);
    return checked ? 0 : told(checked.error());
  }
  auto authority = Authority::open(words[0]);
  if (!authority) return told(authority.error());
  if (words[1] == "issue" && words.size() == 5) {
    const auto role = perimap::role_of_name(words[2]);
    if (!role) return 2;
    const auto issued = authority->issue(
        *role, words[3], {long_ago_to_soon.from, now + std::chrono::seconds(std::atoi(words[4].c_str()))}, false);
    return issued ? 0 : told(issued.error());
  }
  if (words[1] == "revoke" && words.size() == 3) {
    const auto revoked = authority->revoke(words[2], now);
    return revoked ? 0 : told(revoked.error());
  }
  return 2;
}

}  // namespace

int main(int argc, char** argv) { return run(std::vector<std::string>(argv + 1, argv + argc)); }
