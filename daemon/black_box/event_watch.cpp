#include "daemon/black_box/event_watch.hpp"

#include <fmt/format.h>

#include "daemon/publishing/wire_names.hpp"

namespace perimap::black_box {

std::optional<std::string> EventWatch::see(const perimap_Surface& surface) {
  const Surface now{surface.state, surface.reason};
  const auto [before, first] = surfaces_.try_emplace(surface.stream, now);
  if (!first && before->second == now) return std::nullopt;
  before->second = now;
  return fmt::format("surface of stream {} is {}{}{}", surface.stream, name_of(now.state),
                     now.reason == perimap_SURFACE_REASON_NONE ? "" : ": ",
                     now.reason == perimap_SURFACE_REASON_NONE ? std::string_view() : name_of(now.reason));
}

std::optional<std::string> EventWatch::see(const perimap_Phase& phase) {
  if (phase_ == phase.state) return std::nullopt;
  phase_ = phase.state;
  return fmt::format("phase is {}", name_of(phase.state));
}

std::optional<std::string> EventWatch::see(const perimap_Status& status) {
  std::string text;
  const auto add = [&text](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  for (std::uint32_t i = 0; i < status.sources._length; ++i) {
    const perimap_SourceStatus& source = status.sources._buffer[i];
    const auto [before, first] = sources_.try_emplace(source.kind, source.state);
    if (!first && before->second == source.state) continue;
    before->second = source.state;
    add(fmt::format("{} is {}", name_of(source.kind), name_of(source.state)));
  }
  if (setup_ != status.setup.state) {
    setup_ = status.setup.state;
    add(fmt::format("set-up is {}", name_of(status.setup.state)));
  }
  const Late late{status.releases_late, status.releases_missed};
  const auto [before, first] = late_.try_emplace(status.stream, late);
  if (!first && before->second != late) {
    add(fmt::format("stream {}: {} releases late, {} left out", status.stream, late.late - before->second.late,
                    late.missed - before->second.missed));
    before->second = late;
  }
  if (text.empty()) return std::nullopt;
  return text;
}

}  // namespace perimap::black_box
