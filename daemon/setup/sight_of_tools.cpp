#include "daemon/setup/sight_of_tools.hpp"

#include <fmt/format.h>

#include <utility>

namespace perimap {

SightOfTools::SightOfTools(std::vector<std::string> named, Instant begin) {
  for (std::string& name : named) tools_.push_back({std::move(name), begin});
}

void SightOfTools::take(std::size_t tool, const TrackerSample& sample) {
  if (sample.state == ToolState::kOk) tools_.at(tool).seen = sample.arrival;
}

std::string SightOfTools::missing(Instant now) const {
  constexpr Duration kUnseen = std::chrono::seconds(1);
  std::string text;
  for (const Tool& tool : tools_) {
    if (now - tool.seen <= kUnseen) continue;
    text += fmt::format("{}{} has not been seen for {:.0f} s: bring it into sight of the tracker",
                        text.empty() ? "" : "; ", tool.name, to_seconds(now - tool.seen));
  }
  return text;
}

}  // namespace perimap
