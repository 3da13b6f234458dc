// What may be shown of tracked tools beside a surface, and nothing of what may not.
#pragma once

#include <perimap.h>
#include <perimap_tool.h>

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <perimap_tool_client.hpp>
#include <string>
#include <vector>

#include "core/time/instant.hpp"

namespace perimap {

// One tool at a surface's valid_time.
struct ShownTool {
  std::string name;                                   // "pointer", "instrument/NAME"
  client::ToolAtInstant at;                           // refused beside a surface that may not be used
  std::optional<std::array<double, 3>> nearest_W_mm;  // of the surface, `at.distance_mm` from the tip
};

// The newest word of each tool of one perimapd. One thread.
class ShownTools {
 public:
  // More than perimapd has. Of more names than this the one that was heard least lately goes.
  static constexpr std::size_t kMost = 16;

  void take(const perimap_ToolDistance& told);
  // Another publisher, or another instant of a recording.
  void forget() noexcept { tools_.clear(); }

  // By name. `now` on perimapd's clock, as `valid`. What is too old says so for ten seconds, and is left out then. No
  // distance is worth more than `surface`, the state of the surface beside it, whatever was told before that changed:
  // beside one that may not be used tools are named, and nothing is told of where they are.
  [[nodiscard]] std::vector<ShownTool> at(Instant valid, Instant now, perimap_SurfaceState surface) const;

 private:
  std::map<std::string, perimap_ToolDistance, std::less<>> tools_;
};

}  // namespace perimap
