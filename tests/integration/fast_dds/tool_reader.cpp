// tool_reader DOMAIN SECONDS: reads perimap/tool by eProsima Fast DDS, with a type that fastddsgen made of
// idl/perimap_tool.idl, and holds it against the tool that scripted_publisher makes.
#include <array>
#include <cmath>
#include <cstdlib>

#include "fast_reader.hpp"
#include "perimap_toolPubSubTypes.h"

namespace {

using perimap::test::expect;

bool near(double value, double expected) { return std::abs(value - expected) < 1e-12; }

bool judge(const perimap::ToolDistance& tool) {
  expect(tool.source() == "made" && tool.tool() == "instrument/probe" && tool.frame_id() == "tracker", "names");
  expect(tool.run_id()[0] == 1 && tool.run_id()[15] == 0, "whose it is");
  expect(tool.sample_sequence() > 0 && tool.sample_sequence() == tool.surface_sequence(), "sequences");
  expect(tool.valid_until_ns() == tool.time_ns() + 200'000'000, "until when it holds");
  expect(tool.state() == perimap::TOOL_GOOD && tool.reason() == perimap::TOOL_REASON_NONE, "state");
  expect(tool.tip_known() && !tool.touches(), "flags");
  expect(near(tool.tip_W_mm()[0], 4.0) && near(tool.tip_W_mm()[2], 97.0) && near(tool.nearest_W_mm()[2], 100.0),
         "places");
  expect(near(tool.normal_W()[2], -1.0), "normal");
  constexpr std::array<double, 3> kAhead_s = {0.0, 0.1, 0.3};
  for (std::size_t h = 0; h < 3; ++h) {
    expect(tool.states()[h] == perimap::TOOL_GOOD && tool.reasons()[h] == 0, "state of a horizon");
    expect(near(tool.distances_mm()[h], 3.0 - 10.0 * kAhead_s[h]), "distance");
    expect(near(tool.deviations_mm()[h], 0.25 + kAhead_s[h]), "deviation");
    expect(near(tool.rates_mm_per_s()[h], -10.0), "rate");
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace perimap::test;
  if (argc != 3) {
    std::fputs("usage: tool_reader DOMAIN SECONDS\n", stderr);
    return 2;
  }
  FastDomain domain(std::atoi(argv[1]));
  const FastReader<perimap::ToolDistance, perimap::ToolDistancePubSubType> tools(
      domain, "perimap/tool", judge, eprosima::fastdds::dds::BEST_EFFORT_RELIABILITY_QOS);
  const bool right = wait_for(std::atoi(argv[2]), [&] { return tools.content() >= 30; });
  std::printf("Fast DDS read %d distances of a tool; wrong: %d\n", tools.content(), wrong.load());
  std::fflush(stdout);
  std::_Exit(right ? 0 : 1);  // what Fast DDS still runs needs no end
}
