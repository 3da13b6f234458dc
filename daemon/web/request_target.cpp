#include "daemon/web/request_target.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace perimap {
namespace {

constexpr std::string_view kTokenKey = "token=";

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
}

}  // namespace

Expected<RequestTarget> parse_request_target(std::string_view target) {
  if (target.size() > kLongestTarget) {
    return fail(fmt::format("a request's target of {} bytes; at most {} are expected", target.size(), kLongestTarget));
  }
  if (target.empty() || target.front() != '/') return fail("a request's target that does not begin with '/'");
  const std::size_t question = std::min(target.find('?'), target.size());
  const std::string_view path = target.substr(0, question);
  if (!std::all_of(path.begin(), path.end(), [](char c) { return is_plain(c) || c == '/'; })) {
    return fail("a request's path with other bytes than letters, digits and /._-");
  }
  RequestTarget parsed{std::string(path), {}};
  std::string_view query = target.substr(std::min(question + 1, target.size()));
  while (!query.empty()) {
    const std::size_t end = std::min(query.find('&'), query.size());
    const std::string_view part = query.substr(0, end);
    query.remove_prefix(std::min(end + 1, query.size()));
    if (part.substr(0, kTokenKey.size()) != kTokenKey) continue;  // what others add to addresses is nothing to us
    const std::string_view token = part.substr(kTokenKey.size());
    if (!std::all_of(token.begin(), token.end(), is_plain)) return fail("a token with bytes that no token has");
    parsed.token = token;
  }
  return parsed;
}

}  // namespace perimap
