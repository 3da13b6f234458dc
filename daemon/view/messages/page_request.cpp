#include "daemon/view/messages/page_request.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace perimap {
namespace {

constexpr double kLongestRecordingSeconds = 1e7;

}  // namespace

Expected<PageRequest> parse_page_request(std::string_view text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return fail("what a page says is a JSON object");
  const auto at = json.find("at_s");
  if (at == json.end() || !at->is_number()) return fail("what a page says has a number \"at_s\"");
  PageRequest request;
  request.at_s = at->get<double>();
  if (!std::isfinite(request.at_s) || std::abs(request.at_s) > kLongestRecordingSeconds) {
    return fail("\"at_s\" is no instant of a recording");
  }
  if (const auto from_here = json.find("from_here"); from_here != json.end()) {
    if (!from_here->is_boolean()) return fail("\"from_here\" is true or false");
    request.from_here = from_here->get<bool>();
  }
  return request;
}

}  // namespace perimap
