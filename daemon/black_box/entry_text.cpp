#include "daemon/black_box/entry_text.hpp"

#include <perimap.h>

#include <nlohmann/json.hpp>
#include <span>

#include "daemon/publishing/status_text.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/recording/cdr.hpp"

namespace perimap::black_box {
namespace {

using Json = nlohmann::ordered_json;

Json told(const perimap_Surface& surface) {
  std::size_t converged = 0;
  for (std::uint32_t i = 0; i < surface.features._length; ++i) {
    converged += surface.features._buffer[i].state == perimap_FEATURE_CONVERGED ? 1 : 0;
  }
  return {{"stream", surface.stream},
          {"sample_sequence", surface.sample_sequence},
          {"frame_sequence", surface.frame_sequence},
          {"capture_time_ns", surface.capture_time_ns},
          {"release_time_ns", surface.release_time_ns},
          {"valid_time_ns", surface.valid_time_ns},
          {"state", name_of(surface.state)},
          {"reason", name_of(surface.reason)},
          {"features", surface.features._length},
          {"converged", converged},
          {"cardiac_phase_rad", surface.cardiac_phase_rad}};
}

Json told(const perimap_Phase& phase) {
  return {{"sample_sequence", phase.sample_sequence},
          {"state", name_of(phase.state)},
          {"cardiac_phase_rad", phase.cardiac_phase_rad},
          {"beats", phase.beats}};
}

Json told(const perimap_Status& status) { return full_status_json(status); }

template <class T>
Json sample_json(std::string_view content) {
  const auto sample = deserialize<T>(std::as_bytes(std::span(content.data(), content.size())));
  return sample ? told(**sample) : Json{{"unreadable", sample.error().message}};
}

Json content_json(const Entry& entry) {
  switch (entry.kind) {
    case EntryKind::kSurface:
      return sample_json<perimap_Surface>(entry.content);
    case EntryKind::kPhase:
      return sample_json<perimap_Phase>(entry.content);
    case EntryKind::kStatus:
      return sample_json<perimap_Status>(entry.content);
    case EntryKind::kConfiguration:
    case EntryKind::kLog:
      return std::string(entry.content);
    default: {
      Json json = Json::parse(entry.content, nullptr, false);
      return json.is_discarded() ? Json(std::string(entry.content)) : json;
    }
  }
}

}  // namespace

std::string json_of(const Entry& entry) {
  return json_line(Json{{"utc_ns", entry.at.utc_ns},
                        {"monotonic_ns", entry.at.monotonic_ns},
                        {"kind", kind_name(entry.kind)},
                        {"entry", content_json(entry)}});
}

}  // namespace perimap::black_box
