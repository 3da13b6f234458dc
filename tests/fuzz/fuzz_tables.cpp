// Any bytes as a table of poses, of a signal, of points, of motion, of R peaks, as a tool's tip, as a turned scope: an
// error of one line, or finite numbers.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/calibration/tool_tip.hpp"
#include "drivers/calibration/turned_scope_file.hpp"
#include "drivers/pose_file/point_table.hpp"
#include "drivers/pose_file/pose_table.hpp"
#include "drivers/standins/trace/motion_trace.hpp"
#include "tests/fuzz/one_line_error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto poses = parse_pose_table(text, "fuzz.csv", LengthUnit::kMetre); fuzz::is_value(poses)) {
    for (const TimedPose& pose : poses->poses) {
      if (!std::isfinite(pose.t_s) || !pose.X.t.allFinite() || !pose.X.R.allFinite()) std::abort();
    }
  }
  static_cast<void>(fuzz::is_value(parse_signal_table(text, "fuzz.csv")));
  static_cast<void>(fuzz::is_value(parse_point_table(text, "fuzz.csv", LengthUnit::kMillimetre)));
  const auto trace = parse_motion_trace(text, "fuzz.csv");
  if (fuzz::is_value(trace) && !(trace->positions.allFinite() && trace->period_s > 0.0)) std::abort();
  static_cast<void>(fuzz::is_value(parse_r_peaks(text, "fuzz.csv")));
  const auto tip = parse_tool_tip(text, "fuzz.json");
  if (fuzz::is_value(tip) && !(tip->tip_T.allFinite() && tip->covariance_T.allFinite())) std::abort();
  if (const auto scope = parse_turned_scope(text, "fuzz.json"); fuzz::is_value(scope)) {
    const auto setup = scope->at(1.0);
    if (!setup.X_SC.t.allFinite() || !setup.principal_px.allFinite()) std::abort();
  }
  return 0;
}
