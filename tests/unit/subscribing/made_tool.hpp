// How far a tool is, made up.
#pragma once

#include <perimap_tool.h>

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace perimap::test {

// Good at each horizon, at 3 mm, coming by 10 mm/s; valid for 0.2 s after `time_ns`.
inline perimap_ToolDistance made_tool(std::int64_t time_ns, std::string_view name = "instrument/probe",
                                      std::uint64_t sequence = 1) {
  perimap_ToolDistance tool{};
  std::copy_n("made", 5, tool.source);
  std::copy(name.begin(), name.end(), tool.tool);
  std::copy_n("tracker", 8, tool.frame_id);
  tool.run_id[0] = 1;
  tool.sample_sequence = tool.surface_sequence = sequence;
  tool.release_time_ns = tool.time_ns = time_ns;
  tool.valid_until_ns = time_ns + 200'000'000;
  tool.state = perimap_TOOL_GOOD;
  tool.tip_known = true;
  const double tip[] = {4.0, 5.0, 97.0}, nearest[] = {4.0, 5.0, 100.0};
  std::copy_n(tip, 3, tool.tip_W_mm);
  std::copy_n(nearest, 3, tool.nearest_W_mm);
  tool.normal_W[2] = -1.0;
  const double ahead_s[] = {0.0, 0.1, 0.3};
  for (std::size_t h = 0; h < 3; ++h) {
    tool.states[h] = perimap_TOOL_GOOD;
    tool.distances_mm[h] = 3.0 - 10.0 * ahead_s[h];
    tool.rates_mm_per_s[h] = -10.0;
    tool.deviations_mm[h] = 0.25 + ahead_s[h];
  }
  return tool;
}

}  // namespace perimap::test
