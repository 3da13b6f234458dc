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

namespace {

void check_error(const perimap::Error& error) {
  if (error.message.find_first_of("\r\n") != std::string::npos) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto poses = parse_pose_table(text, "fuzz.csv", LengthUnit::kMetre); !poses) {
    check_error(poses.error());
  } else {
    for (const TimedPose& pose : poses->poses) {
      if (!std::isfinite(pose.t_s) || !pose.X.t.allFinite() || !pose.X.R.allFinite()) std::abort();
    }
  }
  if (const auto signal = parse_signal_table(text, "fuzz.csv"); !signal) check_error(signal.error());
  if (const auto points = parse_point_table(text, "fuzz.csv", LengthUnit::kMillimetre); !points) {
    check_error(points.error());
  }
  if (const auto trace = parse_motion_trace(text, "fuzz.csv"); !trace) {
    check_error(trace.error());
  } else if (!trace->positions.allFinite() || !(trace->period_s > 0.0)) {
    std::abort();
  }
  if (const auto peaks_s = parse_r_peaks(text, "fuzz.csv"); !peaks_s) check_error(peaks_s.error());
  if (const auto tip = parse_tool_tip(text, "fuzz.json"); !tip) {
    check_error(tip.error());
  } else if (!tip->tip_T.allFinite() || !tip->covariance_T.allFinite()) {
    std::abort();
  }
  if (const auto scope = parse_turned_scope(text, "fuzz.json"); !scope) {
    check_error(scope.error());
  } else if (const auto setup = scope->at(1.0); !setup.X_SC.t.allFinite() || !setup.principal_px.allFinite()) {
    std::abort();
  }
  return 0;
}
