// Any bytes as a request's target, host, origin and cookie, and as what a page says: read, or refused in one printable
// line; and nothing but the right token lets anyone in from elsewhere.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/view/messages/page_request.hpp"
#include "daemon/web/access.hpp"

namespace {

void check_printable(std::string_view message) {
  if (message.empty() || !std::all_of(message.begin(), message.end(), [](char c) { return c >= ' ' && c <= '~'; })) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view all(reinterpret_cast<const char*>(data), size);
  if (const auto said = parse_page_request(all); !said) check_printable(said.error().message);
  // Lines are the fields of a request.
  std::array<std::string_view, 4> fields;
  std::string_view rest = all;
  for (std::string_view& field : fields) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    field = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  static const std::string token = make_token().value();
  for (const Access& access : {Access{true, 7374, "", {}}, Access{false, 7374, token, {"https://app.example"}}}) {
    const auto target = admit(access, {fields[0], fields[1], fields[2], fields[3]});
    if (!target) {
      check_printable(target.error().message);
      continue;
    }
    if (target->path.empty() || target->path.front() != '/') std::abort();
    if (!access.loopback && all.find(token) == std::string_view::npos) std::abort();
  }
  return 0;
}
