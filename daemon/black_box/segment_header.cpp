#include "daemon/black_box/segment_header.hpp"

#include <nlohmann/json.hpp>

#include "daemon/black_box/json_members.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap::black_box {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const PresentSegment& segment) {
  return {{"segment", segment.number},
          {"entries", segment.entries},
          {"bytes", segment.bytes},
          {"digest", hex_of(segment.digest)},
          {"remainder_bytes", segment.remainder_bytes},
          {"remainder", hex_of(segment.remainder)},
          {"kept", segment.kept},
          {"last_utc_ns", segment.last_utc_ns}};
}

}  // namespace

std::string text_of(const SegmentHeader& header) {
  Json json{{"segment", header.number}, {"program", header.program}, {"source", header.source}, {"run", header.run}};
  json["present"] = Json::array();
  for (const PresentSegment& segment : header.present) json["present"].push_back(json_of(segment));
  return json_line(json);
}

Expected<SegmentHeader> parse_header(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return fail("expected a header as JSON");
  JsonMembers members(json, "the header");
  SegmentHeader header;
  header.number = members.number("segment");
  header.program = members.text("program");
  header.source = members.text("source");
  header.run = members.text("run");
  if (!members.fault().empty()) return fail(members.fault());
  const auto present = json.find("present");
  if (present == json.end() || !present->is_array()) return fail("expected 'present' in the header to be a list");
  for (const Json& told : *present) {
    JsonMembers of(told, "the header");
    PresentSegment segment;
    segment.number = of.number("segment");
    segment.entries = of.number("entries");
    segment.bytes = of.number("bytes");
    segment.digest = of.digest("digest");
    segment.remainder_bytes = of.number("remainder_bytes");
    segment.remainder = of.digest("remainder");
    segment.kept = of.flag("kept");
    segment.last_utc_ns = of.instant("last_utc_ns");
    if (!of.fault().empty()) return fail(of.fault());
    const std::uint64_t before = header.present.empty() ? 0 : header.present.back().number;
    if (segment.number >= header.number || (!header.present.empty() && segment.number <= before)) {
      return fail("expected the segments before it in order of their numbers");
    }
    header.present.push_back(segment);
  }
  return header;
}

}  // namespace perimap::black_box
